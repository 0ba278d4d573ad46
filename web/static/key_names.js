// Names of keys: letters by what is printed on them, by position only where a layout has no Latin letter there; digits by position.
const LATIN = /^[a-z]$/i, LETTER = /^\p{L}$/u, DIGIT = /^\p{Nd}$/u;

export function keyName({ key, code }) {
  const digit = /^(Digit|Numpad)([0-9])$/.exec(code);
  if (digit && (digit[1] === "Digit" || DIGIT.test(key))) return digit[2]; // without NumLock a numeric pad has arrows
  if (LATIN.test(key)) return key.toLowerCase();
  if (/^Key[A-Z]$/.test(code) && LETTER.test(key) && !/\p{Script=Latin}/u.test(key)) return code[3].toLowerCase();
  return key;
}
