// The way in sends its form by itself: the address has been opened by a person's browser, which runs scripts.
document.getElementById("open").requestSubmit();
