for (const figure of document.querySelectorAll(".flip")) {
  const picture = figure.querySelector("img"), own = picture.src, buttons = [...figure.querySelectorAll("button")];
  const show = (k) => {
    picture.src = buttons[k].dataset.of ? document.getElementById(buttons[k].dataset.of).src : own;
    buttons.forEach((b, i) => b.setAttribute("aria-pressed", i === k));
  };
  buttons.forEach((b, k) => b.addEventListener("click", () => show(k)));
  picture.addEventListener("click", () => {
    const now = buttons.findIndex((b) => b.getAttribute("aria-pressed") === "true");
    show((now + 1) % buttons.length);
  });
}
