#include "engine/scene/json_tree.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>

namespace trocar::engine {
namespace {

/// Longest part of a foreign text that a message repeats.
constexpr std::size_t kMaxQuote = 60;

std::string shortened(std::string_view text, std::size_t limit) {
    if (text.size() <= limit) return std::string(text);
    std::size_t cut = limit;
    while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xC0U) == 0x80U) --cut; // not inside a character
    return std::string(text.substr(0, cut)) + "...";
}

/// Lets the parser's callbacks see how far it has read: they get values without positions.
class CountingIterator {
public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = char;
    using difference_type = std::ptrdiff_t;
    using pointer = const char*;
    using reference = const char&;

    CountingIterator() = default;
    CountingIterator(const char* at, const char** reached) : at_(at), reached_(reached) {}
    reference operator*() const { return *at_; }
    CountingIterator& operator++() {
        *reached_ = ++at_;
        return *this;
    }
    CountingIterator operator++(int) {
        const CountingIterator before = *this;
        ++*this;
        return before;
    }
    friend bool operator==(const CountingIterator& a, const CountingIterator& b) { return a.at_ == b.at_; }
    friend bool operator!=(const CountingIterator& a, const CountingIterator& b) { return a.at_ != b.at_; }

private:
    const char* at_ = nullptr;
    const char** reached_ = nullptr;
};

/// Line and column of ascending offsets, counted once.
class LineCounter {
public:
    explicit LineCounter(std::string_view text) : text_(text) {}

    TextPosition at(std::size_t offset) {
        for (offset = std::min(offset, text_.size()); offset_ < offset; ++offset_) {
            if (text_[offset_] == '\n')
                position_ = {position_.line + 1, 1};
            else if ((static_cast<unsigned char>(text_[offset_]) & 0xC0U) != 0x80U)
                ++position_.column;
        }
        return position_;
    }

private:
    std::string_view text_;
    std::size_t offset_ = 0;
    TextPosition position_{1, 1};
};

bool is_number_character(char c) { return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.' || c == 'e' || c == 'E'; }

/// Builds the tree from the parser's callbacks. Returning false stops the parser: error_ says why.
class TreeBuilder : public nlohmann::json_sax<nlohmann::json> {
public:
    TreeBuilder(std::string_view text, std::string_view file_name)
        : reached(text.data()), text_(text), lines_(text), file_name_(file_name) {}

    bool null() override { return add_scalar(JsonType::Null, 4) != nullptr; }
    bool boolean(bool value) override {
        JsonNode* node = add_scalar(JsonType::Flag, value ? 4 : 5);
        if (node != nullptr) node->flag = value;
        return node != nullptr;
    }
    bool number_integer(number_integer_t value) override { return add_number(static_cast<double>(value)); }
    bool number_unsigned(number_unsigned_t value) override { return add_number(static_cast<double>(value)); }
    bool number_float(number_float_t value, const string_t&) override { return add_number(value); }
    bool string(string_t& value) override {
        JsonNode* node = add(JsonType::Text, string_start());
        if (node != nullptr) node->text = std::move(value);
        return node != nullptr;
    }
    bool binary(binary_t&) override { return false; }
    bool start_object(std::size_t) override { return open(JsonType::Object); }
    bool start_array(std::size_t) override { return open(JsonType::List); }
    bool end_array() override {
        open_.pop_back();
        return true;
    }
    bool key(string_t& name) override {
        key_ = std::move(name);
        key_at_ = lines_.at(string_start());
        return true;
    }
    bool end_object() override {
        const JsonNode* object = open_.back();
        open_.pop_back();
        return !has_duplicates(*object);
    }
    bool parse_error(std::size_t position, const std::string&, const nlohmann::json::exception& problem) override {
        fail(syntax_message(position, problem.what()), LineCounter(text_).at(position > 0 ? position - 1 : 0));
        return false;
    }

    const char* reached; // how far the parser has read
    JsonNode root;
    Error error;

private:
    std::size_t offset() const { return static_cast<std::size_t>(reached - text_.data()); }

    /// The closing quote was read last; inside a string every quote follows an odd number of backslashes.
    std::size_t string_start() const {
        std::size_t start = offset() - 2;
        for (;; --start) {
            if (text_[start] != '"') continue;
            std::size_t backslashes = 0;
            while (backslashes < start && text_[start - 1 - backslashes] == '\\') ++backslashes;
            if (backslashes % 2 == 0) return start;
        }
    }

    bool add_number(double value) {
        std::size_t end = offset();
        if (!is_number_character(text_[end - 1])) --end; // the parser reads one character beyond a number
        std::size_t start = end;
        while (start > 0 && is_number_character(text_[start - 1])) --start;
        JsonNode* node = add(JsonType::Number, start);
        if (node == nullptr) return false;
        node->number = value;
        node->text = shortened(text_.substr(start, end - start), kMaxQuote);
        return true;
    }

    JsonNode* add_scalar(JsonType type, std::size_t length) { return add(type, offset() - length); }

    JsonNode* add(JsonType type, std::size_t start) {
        const TextPosition at = lines_.at(start);
        if (++count_ > kMaxJsonValues) {
            fail("more than " + std::to_string(kMaxJsonValues) + " values; long paths belong in a CSV file", at);
            return nullptr;
        }
        JsonNode* node = &root;
        if (!open_.empty()) node = &open_.back()->children.emplace_back();
        node->type = type;
        node->at = at;
        if (!open_.empty() && open_.back()->type == JsonType::Object) {
            node->key = std::move(key_);
            node->key_at = key_at_;
        }
        return node;
    }

    /// Pointers to open nodes stay valid: only the innermost one's list of children grows.
    bool open(JsonType type) {
        JsonNode* node = add(type, offset() - 1);
        if (node == nullptr) return false;
        open_.push_back(node);
        if (open_.size() <= kMaxJsonDepth) return true;
        fail("nested more than " + std::to_string(kMaxJsonDepth) + " levels deep", node->at);
        return false;
    }

    bool has_duplicates(const JsonNode& object) {
        std::vector<const JsonNode*> members;
        for (const JsonNode& member : object.children) members.push_back(&member);
        std::stable_sort(members.begin(), members.end(), [](const JsonNode* a, const JsonNode* b) { return a->key < b->key; });
        const auto twice =
            std::adjacent_find(members.begin(), members.end(), [](const JsonNode* a, const JsonNode* b) { return a->key == b->key; });
        if (twice == members.end()) return false;
        const JsonNode& second = **std::next(twice);
        fail("the key \"" + shortened(second.key, kMaxQuote) + "\" was already given in line " + std::to_string((*twice)->key_at.line) +
                 "; expected once",
             second.key_at);
        error.key = shortened(second.key, kMaxQuote);
        return true;
    }

    /// The library's message without its prefix, with the cause of the most frequent mistakes.
    std::string syntax_message(std::size_t position, std::string_view words) const {
        if (text_.empty()) return "the file is empty; expected a JSON object { ... }";
        const std::size_t start = words.find("syntax error");
        if (start != std::string_view::npos)
            words = words.substr(start);
        else if (const std::size_t bracket = words.find("] "); bracket != std::string_view::npos)
            words = words.substr(bracket + 2);
        std::string message = shortened(words, 240);
        for (char& c : message)
            if (static_cast<unsigned char>(c) < 0x20) c = ' ';
        return message + hint(std::min(position, text_.size()), message);
    }

    std::string hint(std::size_t position, std::string_view message) const {
        if (message.find("number overflow") != std::string_view::npos) return "; expected at most 1.8e308";
        if (text_.size() > 1 && (text_.substr(0, 2) == "\xFF\xFE" || text_.substr(0, 2) == "\xFE\xFF"))
            return "; the file looks like UTF-16, expected UTF-8";
        std::string around(text_.substr(position > 9 ? position - 9 : 0, 18));
        for (char& c : around) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
        if (around.find("nan") != std::string::npos || around.find("inf") != std::string::npos)
            return "; NaN and Infinity are no numbers in JSON";
        const char last = position > 0 ? text_[position - 1] : ' ';
        if (last != '}' && last != ']') return "";
        const std::size_t before = text_.find_last_not_of(" \t\r\n", position > 1 ? position - 2 : 0);
        return before != std::string_view::npos && text_[before] == ',' ? "; the comma before it is one too many" : "";
    }

    void fail(std::string message, TextPosition at) {
        error = {ErrorCode::BadSyntax, std::move(message), std::string(file_name_), at.line, at.column};
    }

    std::string_view text_;
    LineCounter lines_;
    std::string_view file_name_;
    std::vector<JsonNode*> open_;
    std::string key_;
    TextPosition key_at_;
    std::size_t count_ = 0;
};

} // namespace

const JsonNode* JsonNode::find(std::string_view name) const noexcept {
    for (const JsonNode& child : children)
        if (child.key == name) return &child;
    return nullptr;
}

Result<JsonNode> parse_json_tree(std::string_view text, std::string_view file_name) {
    if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
    TreeBuilder builder(text, file_name);
    const CountingIterator first(text.data(), &builder.reached);
    const CountingIterator last(text.data() + text.size(), &builder.reached);
    constexpr bool kStrict = true, kIgnoreComments = true;
    if (nlohmann::json::sax_parse(first, last, &builder, nlohmann::json::input_format_t::json, kStrict, kIgnoreComments))
        return std::move(builder.root);
    return builder.error;
}

std::string describe(const JsonNode& node) {
    switch (node.type) {
    case JsonType::Null:
        return "null";
    case JsonType::Flag:
        return node.flag ? "true" : "false";
    case JsonType::Number:
        return node.text;
    case JsonType::Text:
        return "the string \"" + shortened(node.text, kMaxQuote) + "\"";
    case JsonType::List:
        return "a list of " + std::to_string(node.children.size());
    case JsonType::Object:
        return "an object";
    }
    return "";
}

} // namespace trocar::engine
