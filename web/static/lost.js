// What a page that only looks says where the server did not tell it what it asked for.
const GONE = "No connection to the server. These numbers are of a moment ago.";
const REFUSED = "This page is not open to this browser any more. Reload it to see how to come in.";

export const lost = (reply) => (reply?.status === 401 || reply?.status === 403 ? REFUSED : GONE);
