(() => {
  const part = (name) => document.getElementById(name);
  const boxes = [...document.querySelectorAll("[data-key]")];
  const ask = async (what, body) => {
    const head = { "Content-Type": "application/json" };
    const answer = await fetch(location.pathname + what, { method: "POST", headers: head, body: JSON.stringify(body) });
    return answer.json();
  };
  const written = (box) => (box.type !== "number" ? box.value : box.dataset.unit ? `${box.value} ${box.dataset.unit}` : Number(box.value));
  const values = () =>
    Object.fromEntries(boxes.filter((box) => box.value !== box.dataset.first).map((box) => [box.dataset.key, written(box)]));
  const say = (name, words, bad) => {
    part(name).textContent = words;
    part(name).classList.toggle("bad", Boolean(bad));
  };
  let shown, held = [], busy = false, again = false;
  const save = () => (part("save").href = "data:text/plain;charset=utf-8," + encodeURIComponent(part("case").textContent));
  const draw = async () => {
    if (busy) return void (again = true);
    busy = true;
    do {
      again = false;
      const begun = performance.now();
      try {
        const found = await ask("pass", values());
        if (found.errors) {
          say("state", found.errors.join("; "), true);
          continue;
        }
        shown = found.charts[0][""].data[0];
        found.charts[0][""].data.push(...held);
        document.dispatchEvent(new CustomEvent("charts", { detail: found.charts }));
        document.title = document.querySelector("h1").textContent = found.title;
        part("told").innerHTML = found.told;
        part("command").textContent = found.command;
        part("case").textContent = found.case;
        save();
        const took = performance.now() - begun;
        document.body.dataset.took = took;
        const other = Object.entries(values()).map(([key, value]) => `${key} ${value}`).join(", ");
        say("state", `Other than in the case file: ${other || "nothing"}. Drawn in ${(took / 1000).toFixed(2)} s.`);
      } catch {
        say("state", "No answer: rail-fem app has ended, or its terminal says why.", true);
      }
    } while (again);
    busy = false;
  };
  document.querySelectorAll("#controls label").forEach((row) => {
    const slider = row.querySelector("[type=range]"), box = row.querySelector("[data-key]");
    if (slider) {
      slider.addEventListener("input", () => (box.value = slider.value));
      box.addEventListener("input", () => (slider.value = box.value));
    }
    row.addEventListener("input", draw);
  });
  part("controls").addEventListener("submit", (event) => event.preventDefault());
  part("hold").addEventListener("click", () => {
    held = shown ? [{ ...shown, name: "held", line: { color: "#999999", dash: "dot" } }] : [];
    draw();
  });
  part("reset").addEventListener("click", () => {
    held = [];
    boxes.forEach((box) => (box.value = box.dataset.first));
    document.querySelectorAll("[type=range]").forEach((slider) => (slider.value = slider.getAttribute("value")));
    draw();
  });
  const follow = (found) => {
    if (found.errors) return say("run", found.errors.join("; "), true);
    say("run", found.words, found.words.includes("FAILED"));
    part("bar").hidden = !found.running;
    part("bar").value = found.percent;
    if (found.running) setTimeout(async () => follow(await ask("progress", {})), 1000);
    else if (found.page) part("run").insertAdjacentHTML("beforeend", ' <a href="page" target="_blank">Its page</a>');
  };
  part("start").addEventListener("click", async () => follow(await ask("start", { model: part("model").value, values: values() })));
  save();
  draw();
})();
