// Numbers as pages write them, in the way of server/pages/numbers.py: "7,236" and "0.1235".
export function number(value, digits = 4) {
  if (typeof value !== "number") return value ?? "–";
  return value.toLocaleString("en", { maximumSignificantDigits: Number.isInteger(value) ? 21 : digits });
}
