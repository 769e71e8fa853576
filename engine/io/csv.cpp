#include "engine/io/csv.hpp"

#include <optional>

namespace trocar::engine {

namespace {

/// open_quote  where the quote opens that is never closed; none: all are
std::vector<CsvRow> read_rows(std::string_view text, std::optional<CsvPlace>& open_quote) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    std::vector<CsvRow> rows;
    std::size_t line = 1, column = 0; // of the last character
    CsvRow row{1, {""}, {{1, 1}}};
    bool quoted = false;
    const auto end_row = [&] {
        if (row.cells.size() > 1 || !row.cells.front().empty()) rows.push_back(std::move(row));
        row = {line, {""}, {{line, 1}}};
    };
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '\n')
            ++line, column = 0;
        else if ((static_cast<unsigned char>(c) & 0xC0U) != 0x80U)
            ++column;
        if (quoted) {
            if (c != '"')
                row.cells.back() += c;
            else if (i + 1 < text.size() && text[i + 1] == '"')
                row.cells.back() += text[++i], ++column;
            else
                quoted = false;
        } else if (c == '"')
            quoted = true, open_quote = CsvPlace{line, column};
        else if (c == ',')
            row.cells.emplace_back(), row.places.push_back({line, column + 1});
        else if (c == '\n')
            end_row();
        else if (c != '\r')
            row.cells.back() += c;
    }
    end_row();
    if (!quoted) open_quote.reset();
    return rows;
}

} // namespace

std::vector<CsvRow> read_csv(std::string_view text) {
    std::optional<CsvPlace> passed_over;
    return read_rows(text, passed_over);
}

Result<std::vector<CsvRow>> read_csv(std::string_view text, const std::filesystem::path& file) {
    std::optional<CsvPlace> open_quote;
    std::vector<CsvRow> rows = read_rows(text, open_quote);
    if (open_quote)
        return Error{ErrorCode::BadSyntax, "found a quote that is never closed; expected another one at the end of its cell", file.string(),
                     open_quote->line, open_quote->column};
    return rows;
}

std::string csv_cell(std::string_view text) {
    // a byte order mark in the first cell would be taken for the file's
    if (text.find_first_of(",\"\r\n") == std::string_view::npos && !text.starts_with("\xEF\xBB\xBF")) return std::string(text);
    std::string cell = "\"";
    for (const char c : text) {
        if (c == '"') cell += '"';
        cell += c;
    }
    return cell + "\"";
}

} // namespace trocar::engine
