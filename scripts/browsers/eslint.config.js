// Which interfaces and methods the pages' scripts may use: those that the oldest supported browsers have.
// eslint-plugin-compat knows interfaces (fetch, navigator.locks), eslint-plugin-es-x methods and syntax by the edition of
// the standard. A method is judged by its name, since a script has no types.
import compat from "eslint-plugin-compat";
import esx from "eslint-plugin-es-x";

const BROWSERS = ["chrome 105", "edge 105", "firefox 104", "safari 15.4", "ios_saf 15.4"];

const later = esx.configs["flat/restrict-to-es2022"].rules;
// Of the editions after 2022, what all of these browsers have; and what arrays have under the same name.
const had = [
  "no-array-prototype-findlast-findlastindex",
  "no-hashbang",
  ...["drop", "every", "filter", "find", "flatmap", "foreach", "map", "reduce", "some", "take", "toarray"].map((name) => `no-iterator-prototype-${name}`),
];
// Of the editions until 2022, what one of them lacks: Safari had these in 16.4.
const lacking = ["no-class-static-block", "no-regexp-lookbehind-assertions"];

export default [
  {
    files: ["**/*.js"],
    linterOptions: { noInlineConfig: true },
    languageOptions: { ecmaVersion: "latest", sourceType: "module" },
    plugins: { compat, "es-x": esx },
    // Safari on iPhones has no notifications: sound.js looks for them before it uses them.
    settings: { browsers: BROWSERS, polyfills: ["Notification"], "es-x": { aggressive: true } },
    rules: {
      ...later,
      "compat/compat": "error",
      ...Object.fromEntries(had.map((rule) => [`es-x/${rule}`, "off"])),
      ...Object.fromEntries(lacking.map((rule) => [`es-x/${rule}`, "error"])),
    },
  },
];
