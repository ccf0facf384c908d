// An ECharts chart fed by binary frames: each drops, cuts and appends points, and is acknowledged once drawn.
import { echarts } from "nicegui-echart";

// Who asks for less motion gets some eight pictures a second instead of thirty: each is acknowledged late.
const calm = window.matchMedia("(prefers-reduced-motion: reduce)");
const CALM_MS = 250;

export default {
  template: "<div></div>",
  props: { look: String },
  async mounted() {
    await new Promise((resolve) => setTimeout(resolve, 0)); // wait for the layout of the page
    this.arrays = [];
    this.traces = [];
    this.origin = 0;
    this.chart = echarts.init(this.$el, null, { renderer: "canvas" });
    this.resizeObserver = new ResizeObserver(() => {
      this.chart.resize();
      this.reportSize();
    });
    this.resizeObserver.observe(this.$el);
    this.onFrame = (text, payload) => {
      const header = JSON.parse(text);
      if (`c${header.id}` === this.$el.id) this.applyFrame(header, payload);
    };
    window.socket.on("live_chart", this.onFrame);
    this.followPointer();
    this.update_chart();
    this.reportSize();
  },
  beforeUnmount() {
    window.socket.off("live_chart", this.onFrame);
    this.resizeObserver.disconnect();
    this.chart.dispose();
  },
  methods: {
    reportSize() {
      this.$emit("size", { width: this.$el.offsetWidth });
    },
    update_chart() {
      if (!this.chart) return void setTimeout(this.update_chart, 10);
      const { options, traces } = JSON.parse(this.look);
      this.traces = traces;
      // another look keeps the zoom
      const before = (this.chart.getOption() || {}).dataZoom || [];
      (options.dataZoom || []).forEach((zoom, k) => {
        if (before[k]) Object.assign(zoom, { start: before[k].start, end: before[k].end });
      });
      this.chart.setOption(options, { notMerge: true });
      this.drawMarks();
      this.draw();
    },
    marks(marks, panes) {
      this.eventMarks = { marks, panes };
      this.drawMarks();
    },
    drawMarks() {
      if (!this.chart || !this.eventMarks) return;
      const { marks, panes } = this.eventMarks;
      const series = [];
      for (let pane = 0; pane < panes; pane++) {
        const data = marks.map(([x, text]) => ({ xAxis: x, label: { formatter: text, show: pane === 0 } }));
        const line = { silent: true, symbol: "none", lineStyle: { type: "dotted", color: "#888f99" }, data };
        series.push({ id: `events ${pane}`, type: "line", xAxisIndex: pane, yAxisIndex: pane, data: [], markLine: line });
      }
      this.chart.setOption({ series });
    },
    whole() {
      this.chart?.dispatchAction({ type: "dataZoom", dataZoomIndex: 0, start: 0, end: 100 });
    },
    applyFrame(header, payload) {
      const have = this.arrays.length ? this.arrays[0].length : 0;
      if (!header.reset && header.have !== have) return void this.$emit("lost", {});
      const values = new Float64Array(payload);
      const count = header.arrays;
      const kept = header.reset ? 0 : have - header.cut - header.drop;
      const arrays = [];
      for (let k = 0; k < count; k++) {
        const joined = new Float64Array(kept + header.points);
        if (kept) joined.set(this.arrays[k].subarray(header.drop, header.drop + kept));
        joined.set(values.subarray(k * header.points, (k + 1) * header.points), kept);
        arrays.push(joined);
      }
      this.arrays = arrays;
      this.origin = header.origin;
      this.draw();
      const acknowledge = () => {
        this.$el.dataset.frames = header.number;
        window.socket.emit("live_chart_drawn", window.clientId, header.id, header.number);
      };
      requestAnimationFrame(() => (calm.matches ? setTimeout(acknowledge, CALM_MS) : acknowledge()));
    },
    draw() {
      const traces = this.traces;
      if (!traces.length || !this.arrays.length) return;
      const series = [];
      for (const trace of traces) {
        const x = this.arrays[trace.x];
        const y = this.arrays[trace.y];
        if (!x || !y) return; // points of another view: those of this one are still to come
        const data = new Float64Array(2 * x.length);
        for (let i = 0; i < x.length; i++) {
          data[2 * i] = (x[i] - this.origin) * trace.fx;
          data[2 * i + 1] = y[i] * trace.fy + trace.oy;
        }
        series.push({ id: trace.id, data, dimensions: ["x", "y"] });
      }
      this.chart.setOption({ series });
    },
    followPointer() {
      const zr = this.chart.getZr();
      let pressed = false;
      let pickedAt = 0;
      const pick = (event) => {
        const at = [event.offsetX, event.offsetY];
        const grids = this.chart.getOption().grid || [];
        for (let g = 0; g < grids.length; g++) {
          if (!this.chart.containPixel({ gridIndex: g }, at)) continue;
          pickedAt = performance.now();
          const x = this.chart.convertFromPixel({ xAxisIndex: g }, at[0]);
          return void this.$emit("pick", { x, shift: Boolean(event.event && event.event.shiftKey) });
        }
      };
      zr.on("mousedown", (event) => {
        if (event.event.ctrlKey) return; // this pans
        pressed = true;
        pick(event);
      });
      zr.on("mousemove", (event) => {
        if (pressed && performance.now() - pickedAt > 50) pick(event);
      });
      for (const end of ["mouseup", "globalout"]) zr.on(end, () => (pressed = false));
    },
  },
};
