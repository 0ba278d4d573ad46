// Sentences of the scripts in the language of the page. English stands where it is used; another language comes with the page.
const known = JSON.parse(document.documentElement.dataset.sentences ?? "{}");

export function t(sentence, values = {}) {
  return (known[sentence] ?? sentence).replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
}
