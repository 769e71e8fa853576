#include "engine/step/model_hash.hpp"

#include "engine/step/model_members.hpp"

#include <bit>
#include <concepts>
#include <type_traits>

namespace trocar::engine {

namespace {

template <class T>
concept Number = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <class T>
concept Matrix = requires(const T& value) {
    value.coeff(0, 0);
    value.size();
};
template <class T>
concept Maybe = requires(const T& value) {
    value.has_value();
    *value;
};
template <class T>
concept List = !Matrix<T> && requires(const T& value) {
    std::begin(value);
    std::size(value);
};
template <class T>
concept Pair = requires(const T& value) {
    value.first;
    value.second;
};

/// 64 bits at a time: a model holds millions of numbers. Every step is one-to-one in what came before, so a changed number is another hash
/// unless a later one makes up for it.
class ModelHash {
public:
    template <Number T>
    void add(const T& value) noexcept {
        if constexpr (std::is_same_v<T, double>)
            add_word(std::bit_cast<std::uint64_t>(value));
        else if constexpr (std::is_same_v<T, float>)
            add_word(std::bit_cast<std::uint32_t>(value));
        else if constexpr (std::is_same_v<T, char>)
            add_word(static_cast<unsigned char>(value)); // machines differ in its sign
        else
            add_word(static_cast<std::uint64_t>(value));
    }
    template <Matrix T>
    void add(const T& value) noexcept {
        for (Eigen::Index k = 0; k < value.size(); ++k) add(value.coeff(k % value.rows(), k / value.rows()));
    }
    template <Maybe T>
    void add(const T& value) noexcept {
        add(value.has_value());
        if (value) add(*value);
    }
    template <List T>
    void add(const T& list) noexcept {
        add(std::size(list));
        for (const auto& value : list) add(value);
    }
    template <Pair T>
    void add(const T& pair) noexcept {
        add(pair.first);
        add(pair.second);
    }
    template <class T>
    void add(const T& value) noexcept {
        std::apply([this](const auto&... member) { (add(member), ...); }, members_of(value));
    }
    void add(const EffectDescriptor* effect) noexcept { add(effect != nullptr ? effect->name : std::string_view()); }
    [[nodiscard]] std::uint64_t value() const noexcept { return hash_; }

private:
    /// source   the multiplier is that of MurmurHash2 for 64 bits (Appleby 2008); the shift lets high bits reach low ones
    void add_word(std::uint64_t word) noexcept {
        hash_ = (hash_ ^ word) * 0xc6a4a7935bd1e995ULL;
        hash_ ^= hash_ >> 32;
    }
    std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

} // namespace

std::uint64_t hash_model(const SceneModel& model) noexcept {
    const auto& [name, file, step_s, step_count, fixed_substeps, max_substeps, integrator, budget, budget_covers_step, drop, bodies, nested,
                 instruments, effects, contact, packing] = model;
    ModelHash hash;
    const auto add = [&](const auto&... member) { (hash.add(member), ...); }; // all but file, step_count, budget and packing, which is only reported
    add(name, step_s, fixed_substeps, max_substeps, integrator, budget_covers_step, drop, bodies, nested, instruments, effects, contact);
    return hash.value();
}

} // namespace trocar::engine
