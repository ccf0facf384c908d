// What changes all the time is written into its element: Vue renders nothing then.
const WRITE = {
  text: (element, text) => (element.textContent = text),
  html: (element, html) => (element.innerHTML = html),
  place: (element, place) => Object.assign(element.style, place ? { display: "", ...place } : { display: "none" }),
  share: (element, share) => {
    element.setAttribute("aria-valuenow", share);
    element.style.setProperty("--share", share);
  },
};

export default {
  template: "<div></div>",
  props: { what: String, shown: [String, Number, Object] },
  mounted() {
    this.show(this.shown);
  },
  watch: {
    shown(value) {
      this.show(value);
    },
  },
  methods: {
    show(value) {
      WRITE[this.what](this.$el, value);
    },
  },
};
