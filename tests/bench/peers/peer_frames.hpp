// Shared by the peers of `bench contacts`: the frame sequence, edges, swept boxes of a step, process time, medians, and the one line
// of JSON that each prints. Input is the benchmark's own; errors just end the program.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#include <vector>

namespace peer {

using Id = std::int32_t;
using Corners = std::array<Id, 3>;
using Ends = std::array<Id, 2>;
using Point = std::array<double, 3>;

struct Box {
    Point lo, hi;
    void add(const Box& other) {
        for (int k = 0; k < 3; ++k) {
            lo[k] = std::min(lo[k], other.lo[k]);
            hi[k] = std::max(hi[k], other.hi[k]);
        }
    }
    bool overlaps(const Box& other) const {
        for (int k = 0; k < 3; ++k)
            if (lo[k] > other.hi[k] || other.lo[k] > hi[k]) return false;
        return true;
    }
};

struct Frames {
    std::size_t vertices = 0, triangles = 0, frames = 0;
    std::vector<Corners> triangle;
    std::vector<Ends> edge;              // ascending, each once
    std::vector<Corners> triangle_edges; // of corners 01, 12, 20
    std::vector<Point> position;         // [frames][vertices]

    const Point& at(std::size_t frame, Id vertex) const { return position[frame * vertices + static_cast<std::size_t>(vertex)]; }
    std::size_t steps() const { return frames - 1; }
};

template <class Value>
void read_array(const std::string& file, std::size_t count, std::vector<Value>& out) {
    out.resize(count);
    std::ifstream in(file, std::ios::binary);
    if (!in.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(count * sizeof(Value)))) {
        std::fprintf(stderr, "cannot read %s\n", file.c_str());
        std::exit(2);
    }
}

inline Frames read_frames(const std::string& folder) {
    Frames f;
    std::ifstream meta(folder + "/meta.txt");
    for (std::string key, value; meta >> key >> value;) {
        if (key == "nV") f.vertices = std::stoul(value);
        if (key == "nT") f.triangles = std::stoul(value);
        if (key == "frames") f.frames = std::stoul(value);
    }
    read_array(folder + "/tris.i32", f.triangles, f.triangle);
    read_array(folder + "/pos.f64", f.frames * f.vertices, f.position);
    const auto ends = [&](std::size_t t, std::size_t k) {
        const Id a = f.triangle[t][k], b = f.triangle[t][(k + 1) % 3];
        return Ends{std::min(a, b), std::max(a, b)};
    };
    for (std::size_t t = 0; t < f.triangles; ++t)
        for (std::size_t k = 0; k < 3; ++k) f.edge.push_back(ends(t, k));
    std::sort(f.edge.begin(), f.edge.end());
    f.edge.erase(std::unique(f.edge.begin(), f.edge.end()), f.edge.end());
    f.triangle_edges.resize(f.triangles);
    for (std::size_t t = 0; t < f.triangles; ++t)
        for (std::size_t k = 0; k < 3; ++k)
            f.triangle_edges[t][k] = static_cast<Id>(std::lower_bound(f.edge.begin(), f.edge.end(), ends(t, k)) - f.edge.begin());
    return f;
}

struct StepBoxes {
    std::vector<Box> vertex, edge, face;

    void fill(const Frames& f, std::size_t step) {
        vertex.resize(f.vertices);
        edge.resize(f.edge.size());
        face.resize(f.triangles);
        for (std::size_t v = 0; v < f.vertices; ++v) {
            const Point &a = f.at(step, static_cast<Id>(v)), &b = f.at(step + 1, static_cast<Id>(v));
            for (std::size_t k = 0; k < 3; ++k) {
                vertex[v].lo[k] = std::min(a[k], b[k]);
                vertex[v].hi[k] = std::max(a[k], b[k]);
            }
        }
        const auto box = [&](Id v) -> const Box& { return vertex[static_cast<std::size_t>(v)]; };
        for (std::size_t e = 0; e < edge.size(); ++e) {
            edge[e] = box(f.edge[e][0]);
            edge[e].add(box(f.edge[e][1]));
        }
        for (std::size_t t = 0; t < face.size(); ++t) {
            face[t] = box(f.triangle[t][0]);
            face[t].add(box(f.triangle[t][1]));
            face[t].add(box(f.triangle[t][2]));
        }
    }
};

inline bool holds(const Corners& t, Id v) { return t[0] == v || t[1] == v || t[2] == v; }
inline bool share(const Ends& a, const Ends& b) { return a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1]; }

/// ms of this process.
inline double now_ms() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

struct Series {
    std::vector<double> values;
    void add(double value) { values.push_back(value); }
    double median() const {
        if (values.empty()) return 0.0;
        std::vector<double> sorted = values;
        std::sort(sorted.begin(), sorted.end());
        return sorted[sorted.size() / 2];
    }
    double sum() const {
        double total = 0.0;
        for (const double value : values) total += value;
        return total;
    }
};

struct Measured {
    Series refit, broad, narrow, total, candidates_vf, candidates_ee, hits;

    void print(const char* method, bool same_question) const {
        std::printf("{\"method\": \"%s\", \"same_question\": %s, \"candidates_vf\": %.0f, \"candidates_ee\": %.0f, \"hits_total\": %.0f, "
                    "\"refit_ms\": %.4f, \"broad_ms\": %.4f, \"narrow_ms\": %.4f, \"total_ms\": %.4f}\n",
                    method, same_question ? "true" : "false", candidates_vf.median(), candidates_ee.median(), hits.sum(), refit.median(),
                    broad.median(), narrow.median(), total.median());
    }
};

} // namespace peer
