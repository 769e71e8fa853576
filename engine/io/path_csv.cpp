#include "engine/io/path_csv.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/shown.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>

namespace seldinger::engine {
namespace {

constexpr std::array<std::string_view, 3> kColumns = {"t", "insertion", "rotation"};

/// "insertion_mm", "time [s]", "t": the column's name, a unit behind it or not.
bool is_column(std::string_view field, std::size_t column) {
    if (column == 0 && field.starts_with("time")) return true;
    if (!field.starts_with(kColumns[column])) return false;
    const std::string_view rest = field.substr(kColumns[column].size());
    return rest.empty() || rest[0] == '_' || rest[0] == ' ' || rest[0] == '[' || rest[0] == '(';
}

class PathReader {
public:
    PathReader(std::string_view text, std::string_view name) : text_(text), name_(name) {
        if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
    }

    Result<std::vector<PathRow>> read() {
        while (!text_.empty()) {
            const std::size_t stop = text_.find('\n');
            line_text_ = text_.substr(0, stop);
            text_.remove_prefix(stop == text_.npos ? text_.size() : stop + 1);
            ++line_;
            if (!read_line()) return *error_;
        }
        if (rows_.empty()) return Error{ErrorCode::BadValue, "holds no row of t, insertion, rotation", std::string(name_)};
        return std::move(rows_);
    }

private:
    bool fail(ErrorCode code, std::string message, std::string_view field) {
        error_ = Error{code, std::move(message), std::string(name_), line_};
        error_->column = 1 + static_cast<std::size_t>(field.data() - line_text_.data());
        return false;
    }

    bool read_line() {
        std::string_view content = line_text_.substr(0, line_text_.find('#'));
        if (trim(content).empty()) return true;
        std::array<std::string_view, 3> fields;
        std::size_t count = 0;
        for (bool more = true; more; ++count) {
            const std::size_t comma = content.find(',');
            if (count < 3) fields[count] = trim(content.substr(0, comma));
            more = comma != content.npos;
            if (more) content.remove_prefix(comma + 1);
        }
        if (count != 3) return fail(ErrorCode::BadSyntax, fmt::format("{} columns; t, insertion, rotation are wanted", count), line_text_);
        if (!header_over_ && is_header(fields)) return header_over_ = true;
        header_over_ = true;
        return read_row(fields);
    }

    static bool is_header(const std::array<std::string_view, 3>& fields) {
        return is_column(fields[0], 0) && is_column(fields[1], 1) && is_column(fields[2], 2);
    }

    bool read_row(const std::array<std::string_view, 3>& fields) {
        std::array<double, 3> values{};
        for (std::size_t i = 0; i < 3; ++i) {
            std::string_view field = fields[i];
            if (field.empty()) return fail(ErrorCode::BadSyntax, fmt::format("{} is missing", kColumns[i]), line_text_);
            if (field.starts_with('+')) field.remove_prefix(1);
            const auto [stop, status] = std::from_chars(field.data(), field.data() + field.size(), values[i]);
            if (status == std::errc::invalid_argument || stop != field.data() + field.size())
                return fail(ErrorCode::BadSyntax, fmt::format("{} is '{}', not a number", kColumns[i], shown(fields[i])), fields[i]);
            if (status != std::errc{} || !std::isfinite(values[i]))
                return fail(ErrorCode::BadValue, fmt::format("{} is {}; a finite number is wanted", kColumns[i], shown(fields[i])),
                            fields[i]);
        }
        if (!rows_.empty() && !(values[0] > rows_.back().time))
            return fail(ErrorCode::BadValue, fmt::format("t is {} after {}; it must increase", values[0], rows_.back().time), fields[0]);
        rows_.push_back({values[0], values[1], values[2]});
        return true;
    }

    std::string_view text_, name_, line_text_;
    std::size_t line_ = 0;
    bool header_over_ = false;
    std::vector<PathRow> rows_;
    std::optional<Error> error_;
};

} // namespace

Result<std::vector<PathRow>> parse_path_csv(std::string_view text, std::string_view file_name) {
    return PathReader(text, file_name).read();
}

Result<std::vector<PathRow>> read_path_csv(const std::filesystem::path& path) {
    const Result<std::string> text = read_file_bytes(path);
    if (!text) return text.error();
    return parse_path_csv(*text, path.string());
}

Result<void> write_path_csv(const std::filesystem::path& path, const std::vector<PathRow>& rows) {
    std::string text = "t,insertion,rotation\n";
    for (const PathRow& row : rows) fmt::format_to(std::back_inserter(text), "{},{},{}\n", row.time, row.insertion, row.rotation);
    return write_file_atomically(path, text);
}

} // namespace seldinger::engine
