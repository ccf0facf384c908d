// A mark that is moved by its style: Vue renders nothing when it moves.
export default {
  template: "<i></i>",
  props: { place: Object },
  mounted() {
    this.show(this.place);
  },
  watch: {
    place(place) {
      this.show(place);
    },
  },
  methods: {
    show(place) {
      Object.assign(this.$el.style, place ? { display: "", ...place } : { display: "none" });
    },
  },
};
