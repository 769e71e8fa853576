// What the program writes, column by column and key by key: the writers take their names from these tables, docs/outputs.md all of it.
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// A column of a CSV file, or a key of a JSON file.
struct OutputKey {
    std::string_view name;
    std::string_view unit;    // "" where it has none, "[-]" of a share or ratio
    std::string_view meaning; // a sentence
};

/// One section of the page.
struct OutputTable {
    std::string title;  // file, or the part of it
    std::string intro;  // Markdown; may be empty
    std::vector<OutputKey> keys;
};

using OutputJson = nlohmann::ordered_json;

/// A key of JSON with where its value comes from.
template <class Item>
struct JsonKey {
    OutputKey key;
    OutputJson (*value)(const Item&);
};

/// The value of a key that is left out of the file.
[[nodiscard]] inline OutputJson left_out() { return OutputJson(OutputJson::value_t::discarded); }

/// The item as an object, keys in the table's order.
template <class Item>
[[nodiscard]] OutputJson write_keys(std::span<const JsonKey<Item>> keys, const Item& item) {
    OutputJson json = OutputJson::object();
    for (const JsonKey<Item>& one : keys)
        if (OutputJson value = one.value(item); !value.is_discarded()) json[std::string(one.key.name)] = std::move(value);
    return json;
}

template <class Item>
[[nodiscard]] std::vector<OutputKey> keys_of(std::span<const JsonKey<Item>> keys) {
    std::vector<OutputKey> names;
    for (const JsonKey<Item>& one : keys) names.push_back(one.key);
    return names;
}

/// The tables as sections of a Markdown page.
[[nodiscard]] std::string output_sections(std::span<const OutputTable> tables);

} // namespace trocar::engine
