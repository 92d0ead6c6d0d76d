// Live curves over the scene's time: mass per region, energies, stages, what lists miss.
"use strict";

const CURVE_COLORS = ["#5b9bff", "#d7dde5", "#5fd38d", "#f2a93b", "#ff4d4d"];

function curve(canvas, title, unit, names) {
  return new Chart(canvas, {
    type: "line",
    data: { datasets: names.map((label, k) => ({ label, data: [], borderColor: CURVE_COLORS[k % 5], borderWidth: 1.5, pointRadius: 0 })) },
    options: {
      animation: false, parsing: false, normalized: true, maintainAspectRatio: false,
      scales: {
        x: { type: "linear", ticks: { color: "#8b97a6", maxTicksLimit: 5 }, grid: { color: "#252d38" } },
        y: { ticks: { color: "#8b97a6", maxTicksLimit: 4 }, grid: { color: "#252d38" } },
      },
      plugins: {
        title: { display: true, text: `${title}, ${unit}`, color: "#d7dde5", font: { size: 11 }, padding: 2 },
        legend: { labels: { color: "#8b97a6", boxWidth: 8, boxHeight: 2, font: { size: 10 }, padding: 6 } },
      },
    },
  });
}

class Curves {
  constructor(element) {
    this.mass = curve(element("mass"), "mass", "g", ["source", "in_flight", "receiver", "spilled", "lost"]);
    this.energy = curve(element("energy"), "energy", "mJ", ["kinetic", "potential"]);
    this.stages = curve(element("stages"), "a pass of a stage", "µs", ["build", "density", "force", "integrate"]);
    this.lists = curve(element("lists-curve"), "neighbor lists", "per status", ["rebuilds", "missed pairs"]);
    this.all = [this.mass, this.energy, this.stages, this.lists];
  }

  clear() {
    this.before = null;
    for (const chart of this.all) for (const set of chart.data.datasets) set.data = [];
  }

  add(status) {
    if (this.before && status.time < this.before.time) this.clear();
    const put = (chart, values) => {
      chart.data.datasets.forEach((set, k) => {
        if (values[k] === null || values[k] === undefined) return;
        set.data.push({ x: status.time, y: values[k] });
        // Half as many, evenly, where there are too many: the whole run stays in sight.
        if (set.data.length > 600) set.data = set.data.filter((_, i) => i % 2 === 0);
      });
      chart.update("none");
    };
    put(this.mass, Object.values(status.mass).map((kg) => 1000 * kg));
    put(this.energy, [1000 * status.kinetic_energy, 1000 * status.potential_energy]);
    put(this.stages, Object.values(status.stages));
    const since = (key) => (this.before && status[key] !== undefined ? Math.max(0, status[key] - (this.before[key] || 0)) : null);
    put(this.lists, [since("rebuilds"), since("missed_pairs")]);
    this.before = status;
  }
}
