#include "engine/io/path_csv.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/shown.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>

namespace trocar::engine {
namespace {

constexpr std::array<std::string_view, 3> kColumns = {"t", "insertion", "rotation"};

/// "insertion_mm", "time [s]", "t": the column's name, a unit behind it or not.
bool is_column(std::string_view field, std::size_t column) {
    if (column == 0 && field.starts_with("time")) return true;
    if (!field.starts_with(kColumns[column])) return false;
    const std::string_view rest = field.substr(kColumns[column].size());
    return rest.empty() || rest[0] == '_' || rest[0] == ' ' || rest[0] == '[' || rest[0] == '(';
}

/// Header column "NAME.insertion [mm]": whose it is, and which of kColumns; column 0: neither.
struct NamedColumn {
    std::string_view instrument;
    std::size_t column = 0;
};

NamedColumn named_column(std::string_view field) {
    const std::size_t dot = field.rfind('.');
    if (dot == field.npos || dot == 0) return {};
    for (std::size_t column = 1; column < kColumns.size(); ++column)
        if (is_column(field.substr(dot + 1), column)) return {field.substr(0, dot), column};
    return {};
}

class PathReader {
public:
    PathReader(std::string_view text, std::string_view name) : text_(text), name_(name) {
        if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
    }

    Result<std::vector<NamedPath>> read() {
        while (!text_.empty()) {
            const std::size_t stop = text_.find('\n');
            line_text_ = text_.substr(0, stop);
            text_.remove_prefix(stop == text_.npos ? text_.size() : stop + 1);
            ++line_;
            if (!read_line()) return *error_;
        }
        if (paths_.front().rows.empty()) return Error{ErrorCode::BadValue, "holds no row of t, insertion, rotation", std::string(name_)};
        return std::move(paths_);
    }

private:
    /// Which path a column belongs to, and which of kColumns it is.
    struct Place {
        std::size_t path = 0, column = 0;
    };

    [[nodiscard]] std::size_t column_of(std::string_view field) const {
        return 1 + static_cast<std::size_t>(field.data() - line_text_.data());
    }
    bool fail(ErrorCode code, std::string message, std::string_view field) {
        error_ = Error{code, std::move(message), std::string(name_), line_};
        error_->column = column_of(field);
        return false;
    }

    bool read_line() {
        std::string_view content = line_text_.substr(0, line_text_.find('#'));
        if (trim(content).empty()) return true;
        fields_.clear();
        for (bool more = true; more;) {
            const std::size_t comma = content.find(',');
            fields_.push_back(trim(content.substr(0, comma)));
            more = comma != content.npos;
            if (more) content.remove_prefix(comma + 1);
        }
        const bool may_be_header = !header_over_;
        header_over_ = true;
        if (may_be_header && names_instruments()) return read_names();
        if (fields_.size() != places_.size())
            return fail(ErrorCode::BadSyntax,
                        paths_.front().instrument.empty() ? fmt::format("{} columns; t, insertion, rotation are wanted", fields_.size())
                                                          : fmt::format("{} columns; the header has {}", fields_.size(), places_.size()),
                        line_text_);
        if (may_be_header && is_header()) return true;
        return read_row();
    }

    /// A header without names: the three columns, each once; they are read in its order.
    [[nodiscard]] bool is_header() {
        std::vector<Place> order;
        for (const std::string_view field : fields_)
            for (std::size_t column = 0; column < kColumns.size(); ++column)
                if (is_column(field, column)) order.push_back({0, column});
        const auto holds = [&](std::size_t column) {
            return std::any_of(order.begin(), order.end(), [&](const Place& p) { return p.column == column; });
        };
        if (order.size() != kColumns.size() || !holds(0) || !holds(1) || !holds(2)) return false;
        places_ = std::move(order);
        return true;
    }
    [[nodiscard]] bool names_instruments() const {
        return std::any_of(fields_.begin(), fields_.end(), [](std::string_view field) { return named_column(field).column > 0; });
    }

    bool read_names() {
        paths_.clear();
        places_.clear();
        std::size_t times = 0;
        for (const std::string_view field : fields_) {
            if (is_column(field, 0)) {
                if (++times > 1) return fail(ErrorCode::BadSyntax, "t stands twice; expected once", field);
                places_.push_back({0, 0});
                continue;
            }
            const NamedColumn named = named_column(field);
            if (named.column == 0)
                return fail(
                    ErrorCode::BadSyntax,
                    fmt::format("found the column '{}'; expected t, NAME.insertion or NAME.rotation of an instrument", shown(field)),
                    field.empty() ? line_text_ : field);
            std::size_t path = 0;
            while (path < paths_.size() && paths_[path].instrument != named.instrument) ++path;
            if (path == paths_.size()) paths_.push_back({std::string(named.instrument), {}, line_, column_of(field)});
            for (const Place& known : places_)
                if (known.path == path && known.column == named.column)
                    return fail(ErrorCode::BadSyntax,
                                fmt::format("{}.{} stands twice; expected once", shown(named.instrument), kColumns[named.column]), field);
            places_.push_back({path, named.column});
        }
        if (times == 0) return fail(ErrorCode::BadSyntax, "has no column t", line_text_);
        for (std::size_t path = 0; path < paths_.size(); ++path)
            if (std::count_if(places_.begin(), places_.end(), [&](const Place& p) { return p.path == path && p.column > 0; }) != 2)
                return fail(
                    ErrorCode::BadSyntax,
                    fmt::format("{0}.insertion and {0}.rotation belong together; found one of them", shown(paths_[path].instrument)),
                    line_text_.substr(paths_[path].column - 1));
        return true;
    }

    bool read_number(std::string_view text, const std::string& what, double& value) {
        std::string_view field = text;
        if (field.empty()) return fail(ErrorCode::BadSyntax, fmt::format("{} is missing", what), line_text_);
        if (field.starts_with('+')) field.remove_prefix(1);
        const auto [stop, status] = std::from_chars(field.data(), field.data() + field.size(), value);
        if (status == std::errc::invalid_argument || stop != field.data() + field.size())
            return fail(ErrorCode::BadSyntax, fmt::format("{} is '{}', not a number", what, shown(text)), text);
        if (status != std::errc{} || !std::isfinite(value))
            return fail(ErrorCode::BadValue, fmt::format("{} is {}; a finite number is wanted", what, shown(text)), text);
        return true;
    }

    bool read_row() {
        const auto at = std::find_if(places_.begin(), places_.end(), [](const Place& p) { return p.column == 0; });
        const std::string_view time_field = fields_[static_cast<std::size_t>(at - places_.begin())];
        double time = 0.0;
        if (!read_number(time_field, "t", time)) return false;
        const std::vector<PathRow>& before = paths_.front().rows;
        if (!before.empty() && !(time > before.back().time))
            return fail(ErrorCode::BadValue, fmt::format("t is {} after {}; it must increase", time, before.back().time), time_field);
        for (NamedPath& path : paths_) path.rows.push_back({time, 0.0, 0.0, line_, {column_of(time_field), 0, 0}});
        for (std::size_t i = 0; i < places_.size(); ++i) {
            const std::size_t column = places_[i].column;
            if (column == 0) continue;
            NamedPath& path = paths_[places_[i].path];
            PathRow& row = path.rows.back();
            const std::string prefix = path.instrument.empty() ? "" : std::string(shown(path.instrument)) + ".";
            if (!read_number(fields_[i], prefix + std::string(kColumns[column]), column == 1 ? row.insertion : row.rotation)) return false;
            row.column[column] = column_of(fields_[i]);
        }
        return true;
    }

    std::string_view text_, name_, line_text_;
    std::size_t line_ = 0;
    bool header_over_ = false;
    std::vector<std::string_view> fields_; // of the line
    std::vector<NamedPath> paths_{NamedPath{}};
    std::vector<Place> places_{{0, 0}, {0, 1}, {0, 2}}; // [columns]; the time is no path's own
    std::optional<Error> error_;
};

} // namespace

Result<std::vector<NamedPath>> parse_path_table(std::string_view text, std::string_view file_name) {
    return PathReader(text, file_name).read();
}

Result<std::vector<NamedPath>> read_path_table(const std::filesystem::path& path) {
    const Result<std::string> text = read_file_bytes(path);
    if (!text) return text.error();
    return parse_path_table(*text, path.string());
}

Result<std::vector<PathRow>> parse_path_csv(std::string_view text, std::string_view file_name) {
    Result<std::vector<NamedPath>> paths = parse_path_table(text, file_name);
    if (!paths) return paths.error();
    if (paths->size() == 1) return std::move(paths->front().rows);
    return Error{ErrorCode::BadValue, fmt::format("moves {} instruments; expected one", paths->size()), std::string(file_name),
                 paths->front().line, paths->front().column};
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

} // namespace trocar::engine
