// What is wrong with the page as it is shown now, a line each; nothing of it is the page's own word.
(() => {
  const root = document.documentElement, found = [];
  const over = root.scrollWidth - root.clientWidth;
  if (over > 0) found.push(`sticks out by ${over} pixels`);
  const outer = element => { let svg = element.ownerSVGElement; while (svg.ownerSVGElement) svg = svg.ownerSVGElement; return svg; };
  for (const text of document.querySelectorAll("svg text")) {
    const box = text.getBoundingClientRect();
    if (!text.checkVisibility() || box.width === 0) continue;
    const svg = outer(text), sheet = svg.getBoundingClientRect();
    const size = parseFloat(getComputedStyle(text).fontSize) * sheet.width / svg.viewBox.baseVal.width;
    if (size < 11) found.push(`letters of ${size.toFixed(1)} pixels: ${text.textContent}`);
    if (box.left < sheet.left - 1 || box.right > sheet.right + 1) found.push(`cut: ${text.textContent}`);
  }
  for (const still of document.querySelectorAll("figure.answers .still")) if (still.checkVisibility()) found.push("a picture stands twice");
  for (const figure of document.querySelectorAll("figure")) {
    const isHidden = figure.closest("details:not([open])") || !figure.checkVisibility();
    if (!isHidden && ![...figure.querySelectorAll("svg, canvas")].some(picture => picture.checkVisibility())) found.push("a figure without a picture");
  }
  // what is drawn on a canvas has letters as its script says, in pixels of the screen
  for (const element of document.querySelectorAll(".live *")) {
    const own = [...element.childNodes].some(node => node.nodeType === Node.TEXT_NODE && node.textContent.trim());
    if (own && element.checkVisibility() && parseFloat(getComputedStyle(element).fontSize) < 11) found.push(`small: ${element.textContent}`);
  }
  for (const image of document.querySelectorAll("[role=img]")) {
    if (image.checkVisibility() && !/\d/.test(image.getAttribute("aria-label") ?? "")) found.push("a picture without a number in words");
  }
  return JSON.stringify(found);
})()
