// The size of a question's boards.
// A cell has 16 px at least; what does not fit then is scrolled to, and the agent is in sight.
export function size(form) {
  for (const board of form.querySelectorAll(".board")) {
    const { width, height } = board.viewBox.baseVal;
    board.style.setProperty("--wide", width / 20);
    board.style.setProperty("--high", height / 20);
  }
  for (const part of form.querySelectorAll(".scene, .card")) {
    if (part.scrollWidth <= part.clientWidth) continue;
    const agent = part.querySelector(".agent").getBoundingClientRect(), { left, width } = part.getBoundingClientRect();
    part.scrollLeft += agent.left + agent.width / 2 - left - width / 2;
  }
}
