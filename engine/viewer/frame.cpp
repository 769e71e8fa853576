#include "engine/viewer/frame.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace trocar::engine::viewer {

static_assert(std::endian::native == std::endian::little, "messages are written as they lie in memory");

namespace {

constexpr float kLargestNumber = 65535.0f;
/// Of the surface's size: what a box is wider on either side.
constexpr float kBoxMargin = 0.125f;
/// m; a flat surface's box is not thinner.
constexpr float kThinnestBox = 1e-4f;

enum class Coding : std::uint8_t { Same = 0, Whole = 1, Delta = 2 };

template <class T>
void put(std::string& out, const T& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}
void pad(std::string& out) { out.append((4 - out.size() % 4) % 4, '\0'); }

/// Limits of the finite vertices; infinities swapped where there are none.
struct Limits {
    Point low{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity()};
    Point high{-low[0], -low[1], -low[2]};
};

Limits limits_of(const std::vector<Point>& surface) {
    Limits limits;
    for (const Point& p : surface)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (!std::isfinite(p[axis])) continue;
            limits.low[axis] = std::min(limits.low[axis], p[axis]);
            limits.high[axis] = std::max(limits.high[axis], p[axis]);
        }
    return limits;
}

bool holds(const QuantisedPart& box, const Limits& limits) {
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (limits.low[axis] < box.low[axis] || limits.high[axis] > box.low[axis] + kLargestNumber * box.unit[axis]) return false;
    return true;
}

void make_box(const Limits& limits, QuantisedPart& part) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const bool empty = limits.low[axis] > limits.high[axis];
        const float low = empty ? 0.0f : limits.low[axis];
        const float size = std::max(empty ? 0.0f : limits.high[axis] - low, kThinnestBox);
        part.low[axis] = low - kBoxMargin * size;
        part.unit[axis] = (1.0f + 2.0f * kBoxMargin) * size / kLargestNumber;
    }
}

Coding choose_coding(const std::uint16_t* now, const std::uint16_t* before, std::size_t count) {
    bool same = true;
    for (std::size_t k = 0; k < count; ++k) {
        const int difference = now[k] - before[k];
        if (difference < -128 || difference > 127) return Coding::Whole;
        same = same && difference == 0;
    }
    return same ? Coding::Same : Coding::Delta;
}

void put_block(std::string& out, Coding coding, const std::uint16_t* now, const std::uint16_t* before, std::size_t count) {
    if (coding == Coding::Whole) out.append(reinterpret_cast<const char*>(now), count * sizeof(std::uint16_t));
    if (coding == Coding::Delta)
        for (std::size_t k = 0; k < count; ++k) out.push_back(static_cast<char>(static_cast<std::int8_t>(now[k] - before[k])));
    pad(out);
}

void put_part(std::string& out, const QuantisedPart& now, const QuantisedPart* before) {
    if (before != nullptr && (before->low != now.low || before->unit != now.unit || before->numbers.size() != now.numbers.size()))
        before = nullptr; // another box: its numbers mean something else
    put(out, now.low);
    put(out, now.unit);
    put(out, static_cast<std::uint32_t>(now.numbers.size() / 3));
    const std::size_t size = 3 * kBlockVertices, total = now.numbers.size();
    std::vector<Coding> codings;
    for (std::size_t begin = 0; begin < total; begin += size) {
        const std::size_t count = std::min(size, total - begin);
        codings.push_back(before == nullptr ? Coding::Whole
                          : before == &now  ? Coding::Same
                                            : choose_coding(now.numbers.data() + begin, before->numbers.data() + begin, count));
        put(out, codings.back());
    }
    pad(out);
    for (std::size_t block = 0, begin = 0; begin < total; ++block, begin += size)
        put_block(out, codings[block], now.numbers.data() + begin, before == nullptr ? nullptr : before->numbers.data() + begin,
                  std::min(size, total - begin));
}

std::string encode_tail(const Snapshot& snapshot) {
    std::string out;
    for (const ContactDot& dot : snapshot.contacts) put(out, dot.point), put(out, dot.depth);
    for (const Point& point : snapshot.rod) put(out, point);
    for (const ShownSphere& sphere : snapshot.spheres) put(out, sphere.centre), put(out, sphere.radius);
    for (const ShownSphere& sphere : snapshot.spheres) put(out, sphere.kind);
    pad(out);
    return out;
}

} // namespace

QuantisedPart quantise(const std::vector<Point>& surface, const QuantisedPart* before) {
    QuantisedPart part;
    const Limits limits = limits_of(surface);
    if (before != nullptr && holds(*before, limits))
        part.low = before->low, part.unit = before->unit;
    else
        make_box(limits, part);
    part.numbers.resize(3 * surface.size());
    const Point per_unit{1.0f / part.unit[0], 1.0f / part.unit[1], 1.0f / part.unit[2]};
    for (std::size_t v = 0; v < surface.size(); ++v)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float number = (surface[v][axis] - part.low[axis]) * per_unit[axis];
            part.numbers[3 * v + axis] = number > 0.0f ? static_cast<std::uint16_t>(std::min(number + 0.5f, kLargestNumber)) : 0; // NaN: 0
        }
    return part;
}

void FrameStore::add(const Snapshot& snapshot) {
    const Frame* last = frames_.empty() ? nullptr : &frames_.back();
    Frame frame;
    frame.id = next_id_++;
    for (std::size_t k = 0; k < snapshot.surfaces.size(); ++k) {
        const bool known = last != nullptr && k < last->parts.size();
        if (known && !snapshot.moves[k])
            frame.parts.push_back(last->parts[k]);
        else
            frame.parts.push_back(std::make_shared<QuantisedPart>(quantise(snapshot.surfaces[k], known ? last->parts[k].get() : nullptr)));
    }
    frames_.push_back(std::move(frame));
    if (frames_.size() > kKept) frames_.pop_front();
    time_s_ = snapshot.report.time_s;
    tail_ = encode_tail(snapshot);
    dots_ = static_cast<std::uint32_t>(snapshot.contacts.size());
    spheres_ = static_cast<std::uint32_t>(snapshot.spheres.size());
    rod_points_ = static_cast<std::uint32_t>(snapshot.rod.size());
    encoded_.clear();
}

const FrameStore::Frame* FrameStore::find(std::uint32_t id) const noexcept {
    for (const Frame& frame : frames_)
        if (frame.id == id) return &frame;
    return nullptr;
}

std::shared_ptr<const std::string> FrameStore::encode(std::uint32_t base) {
    if (frames_.empty()) return nullptr;
    const Frame* before = base == 0 ? nullptr : find(base);
    if (before == nullptr) base = 0;
    if (const auto found = encoded_.find(base); found != encoded_.end()) return found->second;
    const Frame& now = frames_.back();
    auto message = std::make_shared<std::string>();
    put(*message, kFrameMessage);
    put(*message, kWireVersion);
    put(*message, static_cast<std::uint16_t>(now.parts.size()));
    put(*message, now.id);
    put(*message, base);
    put(*message, dots_);
    put(*message, time_s_);
    put(*message, spheres_);
    put(*message, rod_points_);
    for (std::size_t k = 0; k < now.parts.size(); ++k)
        put_part(*message, *now.parts[k], before == nullptr ? nullptr : before->parts[k].get());
    *message += tail_;
    return encoded_[base] = std::move(message);
}

std::string encode_model(std::size_t part, const std::vector<Triangle>& triangles, const std::vector<Triangle>& far) {
    std::string out;
    put(out, kModelMessage);
    put(out, kWireVersion);
    put(out, static_cast<std::uint16_t>(part));
    for (const std::vector<Triangle>* list : {&triangles, &far}) {
        put(out, static_cast<std::uint32_t>(list->size()));
        for (const Triangle& triangle : *list)
            for (const Index corner : triangle) put(out, static_cast<std::uint32_t>(corner));
    }
    return out;
}

} // namespace trocar::engine::viewer
