// On a small screen the two clips of a preference take turns on one large board; both play on, in lock-step.
const small = matchMedia("(max-width: 640px), (max-height: 480px)");

export const takesTurns = (form) => small.matches && !!form?.dataset.side;

export function turn(form) {
  form.dataset.side = form.dataset.side === "left" ? "right" : "left";
}
