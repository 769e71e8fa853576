// What a cache entry holds: arrays as plain bytes, all of one machine.
#pragma once

#include "spheretree/sphere_tree.hpp"

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace trocar::engine {

/// Arrays one after another, each behind its count. Reading ends with false where the bytes do.
class Payload {
public:
    Payload() = default;
    explicit Payload(std::string bytes) : bytes_(std::move(bytes)) {}

    template <class T>
    void put(const std::vector<T>& values) {
        const std::uint64_t count = values.size();
        bytes_.append(reinterpret_cast<const char*>(&count), sizeof count);
        bytes_.append(reinterpret_cast<const char*>(values.data()), count * sizeof(T));
    }
    template <class T>
    [[nodiscard]] bool get(std::vector<T>& values) {
        std::uint64_t count = 0;
        if (bytes_.size() - at_ < sizeof count) return false;
        std::memcpy(&count, bytes_.data() + at_, sizeof count);
        at_ += sizeof count;
        if (count > (bytes_.size() - at_) / sizeof(T)) return false;
        values.resize(count);
        if (count > 0) std::memcpy(static_cast<void*>(values.data()), bytes_.data() + at_, count * sizeof(T));
        at_ += count * sizeof(T);
        return true;
    }

    void put_tree(const spheretree::SphereTree& tree) {
        put(tree.spheres), put(tree.parent), put(tree.first_child), put(tree.child_count), put(tree.level), put(tree.level_begin);
        put(tree.items), put(tree.item_begin), put(tree.item_end);
    }
    [[nodiscard]] bool get_tree(spheretree::SphereTree& tree) {
        return get(tree.spheres) && get(tree.parent) && get(tree.first_child) && get(tree.child_count) && get(tree.level) &&
               get(tree.level_begin) && get(tree.items) && get(tree.item_begin) && get(tree.item_end);
    }

    [[nodiscard]] const std::string& bytes() const noexcept { return bytes_; }

private:
    std::string bytes_;
    std::size_t at_ = 0;
};

} // namespace trocar::engine
