#include "engine/report/grant_record.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/state/bit_hash.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <optional>
#include <utility>

namespace trocar::engine {

namespace {

constexpr std::string_view kMagic = "trocar-grants 4";
constexpr std::array<char, 10> kLetters{'d', 'f', 'r', 't', 'x', 'c', 's', 'w', 'a', 'p'}; // by DecisionKind

std::uint64_t hash_bytes(std::string_view bytes) noexcept {
    BitHash hash;
    hash.add_bytes(bytes);
    return hash.value();
}

std::string budget_text(const BudgetLimits& limits) {
    if (limits.mode == BudgetMode::Exact) return "exact";
    if (limits.mode == BudgetMode::Work) return fmt::format("work:{}", limits.work_units);
    return fmt::format("wall:{}", limits.wall_s); // s, all digits
}

/// A name may hold anything; here it must stay on its line.
std::string on_one_line(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    return text;
}

template <class Number>
bool read_number(std::string_view text, Number& value, int base = 10) {
    std::from_chars_result done{};
    if constexpr (std::is_floating_point_v<Number>)
        done = std::from_chars(text.data(), text.data() + text.size(), value);
    else
        done = std::from_chars(text.data(), text.data() + text.size(), value, base);
    return done.ec == std::errc() && done.ptr == text.data() + text.size() && !text.empty();
}

/// Lines of the file and words of a line.
class Lines {
public:
    Lines(std::string_view text, std::string file) : rest_(text), file_(std::move(file)) {}
    [[nodiscard]] bool at_end() const noexcept { return rest_.empty(); }
    std::string_view next() noexcept {
        const std::size_t end = std::min(rest_.find('\n'), rest_.size());
        const std::string_view line = rest_.substr(0, end);
        rest_.remove_prefix(std::min(end + 1, rest_.size()));
        ++number_;
        return line;
    }
    [[nodiscard]] Error error(std::string message) const { return {ErrorCode::BadSyntax, std::move(message), file_, number_}; }

private:
    std::string_view rest_;
    std::string file_;
    std::size_t number_ = 0;
};

std::string_view take_word(std::string_view& line) noexcept {
    const std::size_t end = std::min(line.find(' '), line.size());
    const std::string_view word = line.substr(0, end);
    line.remove_prefix(std::min(end + 1, line.size()));
    return word;
}

/// "key value" with that key; empty otherwise.
std::optional<std::string_view> value_of(std::string_view line, std::string_view key) noexcept {
    if (take_word(line) != key) return std::nullopt;
    return line;
}

bool read_budget(std::string_view text, GrantRecord& record) {
    std::string_view rest = text;
    const std::string_view limit = take_word(rest);
    if (rest != "collision" && rest != "step") return false;
    record.covers_step = rest == "step";
    if (limit == "exact") return true;
    record.limits.mode = limit.starts_with("work:") ? BudgetMode::Work : BudgetMode::Wall;
    if (record.limits.mode == BudgetMode::Work) return read_number(limit.substr(5), record.limits.work_units);
    return limit.starts_with("wall:") && read_number(limit.substr(5), record.limits.wall_s) && record.limits.wall_s >= 0.0;
}

std::optional<Error> read_head(Lines& lines, GrantRecord& record, std::uint64_t& steps) {
    if (const std::string_view magic = lines.next(); magic != kMagic)
        return lines.error(magic.starts_with("trocar-grants")
                               ? fmt::format("\"{:.40}\" is another version; this program reads \"{}\"", magic, kMagic)
                               : fmt::format("no record of grants: it would begin with \"{}\"", kMagic));
    auto scene = value_of(lines.next(), "scene");
    if (!scene || !read_number(take_word(*scene), record.model_hash, 16)) return lines.error("expected \"scene HASH NAME\"");
    record.scene = std::string(*scene);
    const auto budget = value_of(lines.next(), "budget");
    if (!budget || !read_budget(*budget, record)) return lines.error("expected \"budget LIMIT SCOPE\"");
    const auto count = value_of(lines.next(), "steps");
    if (!count || !read_number(*count, steps)) return lines.error("expected \"steps NUMBER\"");
    const auto state = value_of(lines.next(), "state");
    if (!state || !read_number(*state, record.state_hash, 16)) return lines.error("expected \"state HASH\"");
    return std::nullopt;
}

std::optional<Error> read_step(Lines& lines, std::uint64_t number, GrantStep& step) {
    std::string_view line = lines.next();
    std::uint64_t found = 0;
    if (!read_number(take_word(line), found) || found != number) return lines.error(fmt::format("expected step {} here", number));
    if (!read_number(take_word(line), step.fingerprint, 16)) return lines.error("the step's fingerprint is missing");
    while (!line.empty()) {
        const std::string_view word = take_word(line);
        Decision decision;
        const auto letter = word.empty() ? kLetters.end() : std::find(kLetters.begin(), kLetters.end(), word.front());
        if (letter == kLetters.end() || !read_number(word.substr(1), decision.value))
            return lines.error(fmt::format("\"{:.30}\" is no decision; expected d4096, f1, r1, t800, x2, s512, w900, a1 or p40", word));
        decision.kind = static_cast<DecisionKind>(letter - kLetters.begin());
        step.decisions.push_back(decision);
    }
    return std::nullopt;
}

} // namespace

std::uint64_t fingerprint_of(const StepReport& report) noexcept {
    BitHash hash;
    hash.add(report.step);
    hash.add(report.tip);
    for (const double value : {report.kinetic_j, report.elastic_j, report.contact_force_n, report.insertion_m, report.rotation_rad})
        hash.add(value);
    for (const std::uint64_t value :
         {report.pairs_tested, report.pairs_open, report.leaf_contacts, report.candidates, report.exact_contacts,
          report.pressing_contacts})
        hash.add(value);
    return hash.value();
}

std::string grant_record_text(const GrantRecord& record) {
    std::string text =
        fmt::format("{}\nscene {:016x} {}\nbudget {} {}\nsteps {}\nstate {:016x}\n", kMagic, record.model_hash, on_one_line(record.scene),
                    budget_text(record.limits), record.covers_step ? "step" : "collision", record.steps.size(), record.state_hash);
    for (std::size_t k = 0; k < record.steps.size(); ++k) {
        fmt::format_to(std::back_inserter(text), "{} {:016x}", k + 1, record.steps[k].fingerprint);
        for (const Decision& decision : record.steps[k].decisions)
            fmt::format_to(std::back_inserter(text), " {}{}", kLetters[static_cast<std::size_t>(decision.kind)], decision.value);
        text += '\n';
    }
    return text + fmt::format("end {:016x}\n", hash_bytes(text));
}

Result<GrantRecord> parse_grant_record(const std::string& text, const std::filesystem::path& file) {
    Lines lines(text, file.string());
    GrantRecord record;
    std::uint64_t steps = 0;
    if (auto error = read_head(lines, record, steps)) return *error;
    for (std::uint64_t k = 1; k <= steps; ++k) {
        if (lines.at_end()) return lines.error(fmt::format("the record ends after {} of its {} steps: it was cut off", k - 1, steps));
        if (auto error = read_step(lines, k, record.steps.emplace_back())) return *error;
    }
    const std::size_t end = text.rfind("end ");
    std::uint64_t hash = 0;
    const auto sum = value_of(lines.next(), "end");
    if (!sum || !text.ends_with('\n')) return lines.error("the last line, \"end HASH\", is missing: the record was cut off");
    if (!read_number(*sum, hash, 16) || !lines.at_end() || hash != hash_bytes(std::string_view(text).substr(0, end)))
        return lines.error("the record was changed after it was written: its hash does not fit");
    return record;
}

Result<void> write_grant_record(const std::filesystem::path& file, const GrantRecord& record) {
    return write_file_atomically(file, grant_record_text(record));
}

Result<GrantRecord> read_grant_record(const std::filesystem::path& file) {
    const auto text = read_file_bytes(file);
    if (!text.ok()) return text.error();
    return parse_grant_record(*text, file);
}

} // namespace trocar::engine
