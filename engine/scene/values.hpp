// Typed access to a checked object: SI values, the table's defaults where a key is absent.
#pragma once

#include "engine/scene/check.hpp"

#include <cassert>
#include <cmath>
#include <optional>
#include <string>

namespace trocar::engine {

/// A view; node, table and units outlive it. The object has passed check_object: every key asked for is in the table,
/// and what is present has its type.
class Values {
public:
    Values(const JsonNode* node, const ObjectSpec& spec, const Units& units, std::string path)
        : node_(node), spec_(&spec), units_(&units), path_(std::move(path)) {}

    [[nodiscard]] const std::string& path() const noexcept { return path_; }
    [[nodiscard]] std::string path(std::string_view key) const { return join_key(path_, key); }
    /// Is this the alternative with that name in the table?
    [[nodiscard]] bool kind_is(std::string_view name) const noexcept { return spec_->name == name; }
    /// nullptr when the key is absent.
    [[nodiscard]] const JsonNode* find(std::string_view key) const noexcept {
        assert(spec_->find(key) != nullptr);
        return node_ != nullptr ? node_->find(key) : nullptr;
    }
    [[nodiscard]] bool has(std::string_view key) const noexcept { return find(key) != nullptr; }

    [[nodiscard]] double number(std::string_view key) const {
        const JsonNode* member = find(key);
        if (member != nullptr) return member->number * units_->factor(spec_->find(key)->value.dimension);
        return std::get<double>(spec_->find(key)->otherwise);
    }
    template <class T>
    [[nodiscard]] T count(std::string_view key) const {
        const JsonNode* member = find(key);
        return static_cast<T>(member != nullptr ? member->number : std::get<double>(spec_->find(key)->otherwise));
    }
    [[nodiscard]] bool flag(std::string_view key) const {
        const JsonNode* member = find(key);
        return member != nullptr ? member->flag : std::get<bool>(spec_->find(key)->otherwise);
    }
    /// Text, path, choice; empty where the key is absent and the table has no default.
    [[nodiscard]] std::string text(std::string_view key) const {
        const JsonNode* member = find(key);
        if (member != nullptr) return member->text;
        const auto* otherwise = std::get_if<std::string_view>(&spec_->find(key)->otherwise);
        return otherwise != nullptr ? std::string(*otherwise) : std::string();
    }
    /// What a member holds for the choice that is there.
    [[nodiscard]] int choice(std::string_view key) const {
        const ValueSpec& value = spec_->find(key)->value;
        std::size_t i = 0;
        while (value.choices[i] != find(key)->text) ++i; // it passed the check: it is one of them
        return value.value_of(i);
    }
    [[nodiscard]] Vec3 vector(std::string_view key) const {
        const JsonNode* member = find(key);
        if (member == nullptr) return std::get<Vec3>(spec_->find(key)->otherwise);
        Vec3 result;
        for (int i = 0; i < 3; ++i) result[i] = column(*member, *spec_->find(key), static_cast<std::size_t>(i));
        return result;
    }
    /// Number `i` of one row of the key's rows.
    [[nodiscard]] double column(const JsonNode& row, const FieldSpec& field, std::size_t i) const {
        const ValueSpec* value = &field.value;
        if (value->kind == ValueKind::Alternatives)
            for (const ValueSpec& one : field.value.alternatives)
                if (one.kind == ValueKind::Rows) value = &one;
        if (value->kind == ValueKind::List) value = &value->alternatives.front(); // a list of rows
        return row.children[i].number * units_->factor(value->columns[i].dimension);
    }
    [[nodiscard]] double column(std::string_view key, const JsonNode& row, std::size_t i) const {
        return column(row, *spec_->find(key), i);
    }
    /// The object under a key of kind Object, or the object alternative it chose; an absent one has all its defaults.
    [[nodiscard]] Values object(std::string_view key) const {
        const ValueSpec& value = spec_->find(key)->value;
        const JsonNode* member = find(key);
        return at(member, value, path(key));
    }
    /// A value that is an object, or chooses one among alternatives. An absent one is the first object alternative.
    [[nodiscard]] Values at(const JsonNode* member, const ValueSpec& value, std::string path) const {
        const ValueSpec* chosen = &value;
        if (value.kind == ValueKind::Alternatives && member != nullptr) chosen = choose_alternative(*member, value);
        if (value.kind == ValueKind::Alternatives && (chosen == nullptr || chosen->object == nullptr)) {
            for (const ValueSpec& one : value.alternatives)
                if (one.object != nullptr) {
                    chosen = &one;
                    break;
                }
            member = nullptr;
        }
        assert(chosen->object != nullptr);
        return {member, *chosen->object, *units_, std::move(path)};
    }
    /// Element of a list, member of a map.
    [[nodiscard]] Values element(std::string_view key, const JsonNode& child, std::string path) const {
        const ValueSpec* value = &spec_->find(key)->value;
        if (value->kind == ValueKind::Alternatives) value = choose_alternative(*find(key), *value);
        return at(&child, value->alternatives.front(), std::move(path));
    }

private:
    const JsonNode* node_; // nullptr: the object is absent
    const ObjectSpec* spec_;
    const Units* units_;
    std::string path_;
};

} // namespace trocar::engine
