// A bar that is filled by its style: Vue renders nothing when it grows.
export default {
  template: '<div class="bench-progress" role="progressbar" aria-valuemin="0" aria-valuemax="1"><i></i></div>',
  props: { share: Number },
  mounted() {
    this.show(this.share);
  },
  watch: {
    share(share) {
      this.show(share);
    },
  },
  methods: {
    show(share) {
      this.$el.setAttribute("aria-valuenow", share);
      this.$el.firstChild.style.transform = `scaleX(${share})`;
    },
  },
};
