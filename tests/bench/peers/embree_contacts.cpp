// Embree's rtcCollide on swept boxes: vertices against faces and edges against edges, the broad phase's question in float boxes.
// usage   embree_contacts FOLDER [low|refit]
#include "peer_frames.hpp"

#include <embree3/rtcore.h>

#include <cmath>
#include <limits>

namespace {

struct FloatBox {
    float lo[3], hi[3];
    bool overlaps(const FloatBox& o) const {
        for (int k = 0; k < 3; ++k)
            if (lo[k] > o.hi[k] || o.lo[k] > hi[k]) return false;
        return true;
    }
};

FloatBox round_outwards(const peer::Box& box) {
    FloatBox out;
    for (std::size_t k = 0; k < 3; ++k) {
        out.lo[k] = static_cast<float>(box.lo[k]);
        if (out.lo[k] > box.lo[k]) out.lo[k] = std::nextafterf(out.lo[k], -std::numeric_limits<float>::infinity());
        out.hi[k] = static_cast<float>(box.hi[k]);
        if (out.hi[k] < box.hi[k]) out.hi[k] = std::nextafterf(out.hi[k], std::numeric_limits<float>::infinity());
    }
    return out;
}

enum Kind { kVertices, kEdges, kFaces };

struct World {
    peer::Frames frames;
    std::vector<FloatBox> boxes[3];
    RTCScene scene[3];
    RTCGeometry geometry[3];
    std::size_t vertex_face = 0, edge_edge = 0;
} world;

void give_bounds(const RTCBoundsFunctionArguments* a) {
    const FloatBox& b = (*static_cast<const std::vector<FloatBox>*>(a->geometryUserPtr))[a->primID];
    *a->bounds_o = {b.lo[0], b.lo[1], b.lo[2], 0.0f, b.hi[0], b.hi[1], b.hi[2], 0.0f};
}

void count_edges(void*, RTCCollision* found, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
        const unsigned a = found[i].primID0, b = found[i].primID1;
        if (a >= b || peer::share(world.frames.edge[a], world.frames.edge[b])) continue;
        world.edge_edge += world.boxes[kEdges][a].overlaps(world.boxes[kEdges][b]); // leaves hold several boxes
    }
}

void count_faces(void*, RTCCollision* found, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
        const unsigned v = found[i].primID0, t = found[i].primID1;
        if (peer::holds(world.frames.triangle[t], static_cast<peer::Id>(v))) continue;
        world.vertex_face += world.boxes[kVertices][v].overlaps(world.boxes[kFaces][t]);
    }
}

void make_scene(RTCDevice device, Kind kind, std::size_t count, bool refit) {
    world.boxes[kind].resize(count);
    RTCScene scene = world.scene[kind] = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_DYNAMIC);
    RTCGeometry geometry = world.geometry[kind] = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryBuildQuality(geometry, refit ? RTC_BUILD_QUALITY_REFIT : RTC_BUILD_QUALITY_LOW);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(count));
    rtcSetGeometryUserData(geometry, &world.boxes[kind]);
    rtcSetGeometryBoundsFunction(geometry, give_bounds, nullptr);
    rtcSetGeometryIntersectFunction(geometry, [](const RTCIntersectFunctionNArguments*) {});
    rtcSetGeometryOccludedFunction(geometry, [](const RTCOccludedFunctionNArguments*) {});
    rtcAttachGeometry(scene, geometry);
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    world.frames = peer::read_frames(argv[1]);
    const std::string mode = argc > 2 ? argv[2] : "low";
    RTCDevice device = rtcNewDevice("threads=1,set_affinity=0,user_threads=1");
    make_scene(device, kVertices, world.frames.vertices, mode == "refit");
    make_scene(device, kEdges, world.frames.edge.size(), mode == "refit");
    make_scene(device, kFaces, world.frames.triangles, mode == "refit");
    peer::StepBoxes boxes;
    peer::Measured measured;
    for (std::size_t step = 0; step < world.frames.steps(); ++step) {
        const double start = peer::now_ms();
        boxes.fill(world.frames, step);
        const std::vector<peer::Box>* from[3] = {&boxes.vertex, &boxes.edge, &boxes.face};
        for (int kind = 0; kind < 3; ++kind) {
            std::transform(from[kind]->begin(), from[kind]->end(), world.boxes[kind].begin(), round_outwards);
            rtcCommitGeometry(world.geometry[kind]);
            rtcCommitScene(world.scene[kind]);
        }
        const double built = peer::now_ms();
        world.vertex_face = world.edge_edge = 0;
        rtcCollide(world.scene[kEdges], world.scene[kEdges], count_edges, nullptr);
        rtcCollide(world.scene[kVertices], world.scene[kFaces], count_faces, nullptr);
        const double end = peer::now_ms();
        measured.refit.add(built - start);
        measured.broad.add(end - built);
        measured.total.add(end - start);
        measured.candidates_vf.add(static_cast<double>(world.vertex_face));
        measured.candidates_ee.add(static_cast<double>(world.edge_edge));
    }
    measured.print(("embree-" + mode).c_str(), true);
}
