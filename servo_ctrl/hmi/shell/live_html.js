// HTML that is written into its element: Vue renders nothing when it changes.
export default {
  template: "<div></div>",
  props: { innerHTML: String, sanitize: Boolean, tag: String },
  mounted() {
    this.show(this.innerHTML);
  },
  watch: {
    innerHTML(html) {
      this.show(html);
    },
  },
  methods: {
    show(html) {
      this.$el.innerHTML = html;
    },
  },
};
