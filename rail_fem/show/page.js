"use strict";
(async () => {
  const unpack = async (name) => {
    const bytes = Uint8Array.from(atob(document.getElementById(name).textContent), (c) => c.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  };
  try {
    const charts = JSON.parse(await unpack("charts"));
    const draws = [];
    const library = document.createElement("script");
    library.textContent = await unpack("library");
    document.head.append(library);
    document.querySelectorAll(".chart").forEach((block, number) => {
      const menus = [...block.querySelectorAll("select")];
      const plot = block.querySelector(".plot");
      const still = () =>
        Plotly.toImage(plot, { format: "png", width: 1040, height: plot.clientHeight }).then((url) => {
          block.querySelector("img").src = url;
        });
      const draw = () => {
        const picture = charts[number][menus.map((menu) => menu.value).join("\n")];
        block.querySelector("p.none").hidden = Boolean(picture);
        const { data, layout } = picture || { data: [], layout: {} };
        Plotly.react(plot, data, layout, { responsive: true, displaylogo: false });
      };
      menus.forEach((menu) => menu.addEventListener("change", draw));
      draws.push(draw);
      draw();
      if (block.classList.contains("turns")) {
        still();
        plot.on("plotly_relayout", still);
      }
    });
    document.addEventListener("charts", ({ detail }) => {
      charts.splice(0, charts.length, ...detail);
      draws.forEach((draw) => draw());
    });
    document.body.dataset.drawn = "yes";
  } catch (error) {
    document.getElementById("undrawn").hidden = false;
    throw error;
  }
})();
