// A page that the command writes, inside this one: report.css is the style of both.

import { make } from "./dom.js";

export function report(html) {
  // its own style is report.css as well
  const page = new DOMParser().parseFromString(html.replace(/<style>[^]*?<\/style>/, ""), "text/html");
  const host = make("div", { class: "report" });
  host.append(...[...page.querySelector("main").childNodes].map((node) => document.importNode(node, true)));
  return host;
}
