// CGAL's box_intersection_d on swept boxes: vertices against faces and edges against edges, the broad phase's question.
// usage   cgal_contacts FOLDER
#include "peer_frames.hpp"

#include <CGAL/box_intersection_d.h>

namespace {

struct NumberedBox {
    peer::Box box;
    std::size_t id;
};

/// Access without copies, as the library's traits want it.
struct Traits {
    using Box_parameter = const NumberedBox*;
    using NT = double;
    using ID = std::size_t;
    static NT min_coord(Box_parameter b, int axis) { return b->box.lo[static_cast<std::size_t>(axis)]; }
    static NT max_coord(Box_parameter b, int axis) { return b->box.hi[static_cast<std::size_t>(axis)]; }
    static ID id(Box_parameter b) { return b->id; }
    static int dimension() { return 3; }
};

/// Boxes of at most this many are compared one by one; the library's default of 10 is slower on these scenes.
constexpr std::ptrdiff_t kCutoff = 100;

void number(const std::vector<peer::Box>& from, std::size_t first_id, std::vector<NumberedBox>& boxes,
            std::vector<const NumberedBox*>& pointers) {
    boxes.resize(from.size());
    pointers.resize(from.size());
    for (std::size_t i = 0; i < from.size(); ++i) {
        boxes[i] = {from[i], first_id + i};
        pointers[i] = &boxes[i];
    }
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    const peer::Frames frames = peer::read_frames(argv[1]);
    peer::StepBoxes boxes;
    peer::Measured measured;
    std::vector<NumberedBox> vertex, edge, face;
    std::vector<const NumberedBox*> vertices, edges, faces;
    const CGAL::Box_intersection_d::Predicate_traits_d<Traits, true> traits;
    for (std::size_t step = 0; step < frames.steps(); ++step) {
        const double start = peer::now_ms();
        boxes.fill(frames, step);
        number(boxes.vertex, 0, vertex, vertices);
        number(boxes.face, frames.vertices, face, faces); // ids must differ between the two
        number(boxes.edge, 0, edge, edges);
        std::vector<const NumberedBox*> edges_again = edges;
        const double built = peer::now_ms();
        std::size_t vertex_face = 0, edge_edge = 0;
        CGAL::box_intersection_custom_predicates_d(
            vertices.begin(), vertices.end(), faces.begin(), faces.end(),
            [&](const NumberedBox* v, const NumberedBox* f) {
                vertex_face += !peer::holds(frames.triangle[f->id - frames.vertices], static_cast<peer::Id>(v->id));
            },
            traits, kCutoff, CGAL::Box_intersection_d::BIPARTITE);
        CGAL::box_intersection_custom_predicates_d(
            edges.begin(), edges.end(), edges_again.begin(), edges_again.end(),
            [&](const NumberedBox* a, const NumberedBox* b) { edge_edge += !peer::share(frames.edge[a->id], frames.edge[b->id]); }, traits,
            kCutoff, CGAL::Box_intersection_d::COMPLETE);
        const double end = peer::now_ms();
        measured.refit.add(built - start);
        measured.broad.add(end - built);
        measured.total.add(end - start);
        measured.candidates_vf.add(static_cast<double>(vertex_face));
        measured.candidates_ee.add(static_cast<double>(edge_edge));
    }
    measured.print("cgal-box-intersection", true);
}
