// A page that the command writes, inside this one: report.css is the style of both.

import { make } from "./dom.js";

export function report(html) {
  const page = new DOMParser().parseFromString(html, "text/html");
  const host = make("div", { class: "report" });
  // its own style, which is this page's too, stays behind with its head
  host.append(...[...page.querySelector("main").childNodes].map((node) => document.importNode(node, true)));
  return host;
}
