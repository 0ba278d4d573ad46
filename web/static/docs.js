// The API's page: starts Swagger UI on the API's own description. Nothing is asked of any other host.
const dark = matchMedia("(prefers-color-scheme: dark)");
const follow = () => document.documentElement.classList.toggle("dark-mode", dark.matches);
dark.addEventListener("change", follow);
follow();

window.SwaggerUIBundle({
  url: "/api/v1/openapi.json",
  dom_id: "#swagger",
  deepLinking: true,
  docExpansion: "list",
  defaultModelsExpandDepth: -1, // the schemas stand with the routes that use them
  tryItOutEnabled: true,
  validatorUrl: null, // it would ask another host
  onComplete: () => document.getElementById("operations")?.setAttribute("role", "group"), // ours is the one main
});
