// Errors of a page: what tells of them is loaded when there is one (error_line.js).
const told = (...error) => import("./error_line.js").then(({ tell }) => tell(...error), () => null);

addEventListener("error", ({ message, filename, lineno, colno, error }) => {
  if (message) told(message, { source: filename, row: lineno, column: colno, stack: error?.stack });
});
addEventListener("unhandledrejection", ({ reason }) => told(reason?.message ?? reason, { stack: reason?.stack }));
