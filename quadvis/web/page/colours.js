// Colours of curves, distinguishable for the colour-blind, and those of the page, for canvases.

const dark = matchMedia("(prefers-color-scheme: dark)");
const ON_LIGHT = ["#005f9e", "#b35900", "#00755a", "#a3336f", "#5a4aa8", "#7d6b00", "#333333", "#c0392b"];
const ON_DARK = ["#6db8ec", "#f0a04b", "#4cc9a4", "#e88bbf", "#a99cf0", "#d8c34a", "#dddddd", "#ff8a7a"];

export const colours = () => (dark.matches ? ON_DARK : ON_LIGHT);

/** Return a colour of the page by its name in the style sheet. */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

export const onScheme = (changed) => dark.addEventListener("change", changed);
