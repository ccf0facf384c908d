// A text that is written into its element: Vue renders nothing when it changes.
export default {
  template: "<div></div>",
  props: { text: String },
  mounted() {
    this.show(this.text);
  },
  watch: {
    text(text) {
      this.show(text);
    },
  },
  methods: {
    show(text) {
      this.$el.textContent = text;
    },
  },
};
