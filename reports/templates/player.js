const plot = document.getElementById("{plot_id}"), layouts = {{ layouts | tojson }};
let shown;
function arrange() {
    const fits = layouts[plot.clientWidth < {{ wide }} ? "narrow" : "wide"];
    if (fits === shown) return;
    shown = fits;
    plot.style.height = fits.height + "px";
    Plotly.relayout(plot, fits.change);
}
arrange();
window.addEventListener("resize", arrange);
