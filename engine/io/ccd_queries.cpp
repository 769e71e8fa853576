#include "engine/io/ccd_queries.hpp"

#include "engine/io/file_bytes.hpp"
#include "engine/io/shown.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <string>

namespace trocar::engine {
namespace {

constexpr std::size_t kColumns = 7;
constexpr std::size_t kRows = 8; // of one query

/// An integer as the nearest double; `exact` turns false where digits are lost.
struct Whole {
    double value = 0.0;
    bool exact = true;
};
std::optional<Whole> parse_whole(std::string_view field) {
    std::string_view digits = field.starts_with('-') || field.starts_with('+') ? field.substr(1) : field;
    if (digits.empty() || digits.find_first_not_of("0123456789") != digits.npos) return std::nullopt;
    Whole out;
    if (std::from_chars(digits.data(), digits.data() + digits.size(), out.value).ec == std::errc::result_out_of_range)
        out.value = std::numeric_limits<double>::infinity();
    std::uint64_t small = 0;
    const bool fits = std::from_chars(digits.data(), digits.data() + digits.size(), small).ec == std::errc();
    // Longer numbers are powers of two in the benchmark; they are compared by printing the double in full.
    out.exact = fits ? out.value < 0x1p64 && static_cast<std::uint64_t>(out.value) == small
                     : fmt::format("{:.0f}", out.value) == digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
    if (field.starts_with('-')) out.value = -out.value;
    return out;
}

class QueryReader {
public:
    QueryReader(std::string_view text, std::string_view name) : text_(text), name_(name) {}

    Result<CcdQueryFile> read() {
        while (!text_.empty()) {
            const std::size_t stop = text_.find('\n');
            const std::string_view line = trim(text_.substr(0, stop));
            text_.remove_prefix(stop == text_.npos ? text_.size() : stop + 1);
            ++line_;
            if (!line.empty() && !read_row(line)) return *error_;
        }
        if (row_ != 0)
            return Error{ErrorCode::BadSyntax, fmt::format("the last query has {} of its 8 rows", row_), std::string(name_), line_};
        if (file_.queries.empty()) return Error{ErrorCode::BadValue, "holds no query of 8 rows", std::string(name_)};
        return std::move(file_);
    }

private:
    bool fail(ErrorCode code, std::string message) {
        error_ = Error{code, std::move(message), std::string(name_), line_};
        return false;
    }

    bool read_row(std::string_view line) {
        std::array<std::string_view, kColumns> fields;
        std::size_t count = 0;
        for (bool more = true; more; ++count) {
            const std::size_t comma = line.find(',');
            if (count < kColumns) fields[count] = trim(line.substr(0, comma));
            more = comma != line.npos;
            if (more) line.remove_prefix(comma + 1);
        }
        if (count != kColumns)
            return fail(ErrorCode::BadSyntax,
                        fmt::format("{} columns; 7 are wanted: three coordinates as numerator, denominator, and the answer", count));
        if (row_ == 0) file_.queries.emplace_back();
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (!read_coordinate(fields[2 * axis], fields[2 * axis + 1], axis)) return false;
        return read_truth(fields[6]);
    }

    bool read_coordinate(std::string_view upper, std::string_view lower, std::size_t axis) {
        const auto numerator = parse_whole(upper), denominator = parse_whole(lower);
        if (!numerator || !denominator)
            return fail(ErrorCode::BadSyntax, fmt::format("'{}' is not an integer", shown(numerator ? lower : upper)));
        if (denominator->value == 0.0) return fail(ErrorCode::BadValue, fmt::format("the denominator of {} is 0", "xyz"[axis]));
        const double value = numerator->value / denominator->value;
        if (!std::isfinite(value)) return fail(ErrorCode::BadValue, fmt::format("{} is beyond the largest double", "xyz"[axis]));
        const bool divides = std::fma(value, denominator->value, -numerator->value) == 0.0;
        file_.rounded += !(numerator->exact && denominator->exact && divides);
        file_.queries.back().rows[row_][static_cast<Eigen::Index>(axis)] = value;
        return true;
    }

    bool read_truth(std::string_view field) {
        if (field != "0" && field != "1")
            return fail(ErrorCode::BadValue, fmt::format("the answer is '{}'; 0 or 1 is wanted", shown(field)));
        CcdQuery& query = file_.queries.back();
        const bool collides = field == "1";
        if (row_ > 0 && collides != query.collides)
            return fail(ErrorCode::BadValue, "the answer differs from that of the query's rows above");
        query.collides = collides;
        row_ = (row_ + 1) % kRows;
        return true;
    }

    std::string_view text_, name_;
    std::size_t line_ = 0, row_ = 0;
    CcdQueryFile file_;
    std::optional<Error> error_;
};

} // namespace

Result<CcdQueryFile> parse_ccd_queries(std::string_view text, std::string_view file_name) { return QueryReader(text, file_name).read(); }

Result<CcdQueryFile> read_ccd_queries(const std::filesystem::path& path) {
    const Result<std::string> text = read_file_bytes(path);
    if (!text) return text.error();
    return parse_ccd_queries(*text, path.string());
}

} // namespace trocar::engine
