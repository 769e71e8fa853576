#include "engine/cli/contact_method.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string_view>

namespace trocar::engine {
namespace {

/// The number behind a word's beginning.
std::optional<std::size_t> number_after(std::string_view word, std::string_view beginning) {
    if (!word.starts_with(beginning)) return std::nullopt;
    word.remove_prefix(beginning.size());
    std::size_t number = 0;
    const auto [stop, status] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (status != std::errc() || stop != word.data() + word.size()) return std::nullopt;
    return number;
}

bool take_word(std::string_view word, ContactMethod& method) {
    if (word == "exact") return true;
    if (word == "plain") return !(method.simd = false);
    if (word == "fine") return method.tree.fine = true;
    if (word == "brute") return method.brute = true;
    using collision::TreeBuilder;
    for (const auto& [name, builder] :
         {std::pair{"sah", TreeBuilder::Sah}, {"median", TreeBuilder::Median}, {"paper", TreeBuilder::Middle}})
        if (word == name) {
            method.tree.builder = builder;
            return true;
        }
    if (const auto k = number_after(word, "dop"); k && collision::is_dop(*k)) {
        method.tree.dop = *k;
        return true;
    }
    if (const auto n = number_after(word, "arity"); n && (*n == 2 || *n == 4 || *n == 8)) {
        method.tree.arity = *n;
        return true;
    }
    if (const auto n = number_after(word, "cluster"); n && *n >= 1 && *n <= collision::DopTree::kMaxClusterSize) {
        method.tree.cluster_size = *n;
        return true;
    }
    return false;
}

struct SetMethod {
    std::string_view name;
    CullMethod culling;
    bool image_space;
    bool as_paper = false; // of image_space: the form of the image-space paper, which can lose crossings
    bool patches = true;   // of the conservative form: whole patches first
};
constexpr SetMethod kSetMethods[] = {
    {"chromatic", CullMethod::Auto, false},
    {"chromatic-cpu", CullMethod::Cpu, false},
    {"chromatic-gl", CullMethod::Gl, false},
    {"chromatic-none", CullMethod::None, false},
    {"chromatic-query", CullMethod::Query, false},
    {"image-space", CullMethod::Cpu, true},
    {"image-space-gl", CullMethod::Gl, true},
    {"image-space-paper", CullMethod::Cpu, true, true},
    {"image-space-flat", CullMethod::Cpu, true, false, false},
};

} // namespace

std::string ContactMethod::name() const {
    for (const SetMethod& known : kSetMethods)
        if (culling == known.culling && image_space == known.image_space && as_paper == known.as_paper && patches == known.patches)
            return std::string(known.name);
    if (brute) return "exact-brute";
    const char* builder = tree.builder == collision::TreeBuilder::Sah      ? "sah"
                          : tree.builder == collision::TreeBuilder::Median ? "median"
                                                                           : "paper";
    return fmt::format("exact-dop{}-arity{}-{}-cluster{}{}{}", tree.dop, tree.arity, builder, tree.cluster_size, tree.fine ? "-fine" : "",
                       simd ? "" : "-plain");
}

Result<ContactMethod> parse_contact_method(const std::string& text) {
    ContactMethod method;
    for (const SetMethod& known : kSetMethods)
        if (text == known.name) {
            method.culling = known.culling;
            method.image_space = known.image_space;
            method.as_paper = known.as_paper;
            method.patches = known.patches;
            return method;
        }
    std::string_view rest = text;
    while (true) {
        const std::size_t dash = rest.find('-');
        const std::string_view word = rest.substr(0, dash);
        if (!take_word(word, method))
            return Error{ErrorCode::BadUsage, fmt::format("'{}' is no word of a method; {}", word.substr(0, 40), kMethodWords), {}, 0, 0,
                         "--method"};
        if (dash == rest.npos) return method;
        rest.remove_prefix(dash + 1);
    }
}

} // namespace trocar::engine
