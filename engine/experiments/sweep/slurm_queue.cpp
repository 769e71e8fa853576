#include "engine/experiments/sweep/slurm_queue.hpp"

#include "engine/experiments/sweep/result_store.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/prepare/process.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <sstream>

namespace trocar::engine {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience_s = 120.0;         // for a command of Slurm
constexpr std::size_t kMostNamed = 12;       // chunks of one line
constexpr const char* kHeld = "HELD";        // our word: waiting until somebody releases it

std::vector<std::uint64_t> chunks_of(const std::string& line) {
    std::vector<std::uint64_t> chunks;
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, ',');) chunks.push_back(std::strtoull(word.c_str(), nullptr, 10));
    return chunks;
}

/// One array job of the folder.
struct Submission {
    std::string id;
    std::vector<std::vector<std::uint64_t>> tasks; // chunks of each, from task 1
    std::map<std::size_t, std::string> states;     // of the tasks that Slurm knows
};

/// Nothing of one that was never finished.
std::optional<Submission> read_submission(const fs::path& folder, int number) {
    const auto id = read_file_bytes(slurm_file(folder, number, "job")), tasks = read_file_bytes(slurm_file(folder, number, "tasks"));
    if (!id || !tasks) return std::nullopt;
    Submission one;
    one.id = id->substr(0, id->find_first_not_of("0123456789"));
    std::istringstream text(*tasks);
    for (std::string line; std::getline(text, line);) one.tasks.push_back(chunks_of(line));
    return one;
}

void note_state(Submission& one, std::string_view task, std::string_view state) {
    std::size_t number = 0;
    const auto read = std::from_chars(task.data(), task.data() + task.size(), number);
    if (read.ec != std::errc() || read.ptr != task.data() + task.size() || number < 1 || number > one.tasks.size()) return;
    one.states.insert_or_assign(number, std::string(state.substr(0, state.find_first_of(" +"))));  // "CANCELLED by 0"
}

/// Tasks in the queue, and those that left it some minutes ago.
void ask_squeue(Submission& one, const fs::path& folder, SlurmQueue& queue) {
    const auto said = call_slurm("squeue", {"-h", "-r", "-t", "all", "-j", one.id, "-o", "%K %T %r"}, folder);
    if (!said) {
        if (said.error().message.find("Invalid job id") == std::string::npos) queue.failure = said.error().message; // long gone
        return;
    }
    std::istringstream rows(*said);
    for (std::string row; std::getline(rows, row);) {
        std::istringstream words(row);
        std::string task, state, reason;
        words >> task >> state;
        std::getline(words, reason); // "JobHeldUser", "launch failed requeued held"
        const bool is_held = reason.find("Held") != std::string::npos || reason.ends_with("held");
        note_state(one, task, (state == "PENDING" && is_held) || state.find("HOLD") != std::string::npos ? kHeld : state);
    }
}

/// Tasks that the queue has forgotten. A requeued one is told in its last life.
void ask_sacct(Submission& one, const fs::path& folder, SlurmQueue& queue) {
    if (one.states.size() == one.tasks.size()) return;
    const auto said = call_slurm("sacct", {"-n", "-P", "-X", "-j", one.id, "-o", "JobID,State"}, folder);
    if (!said) {
        queue.unknown_reason = said.error().message;
        return;
    }
    std::istringstream rows(*said);
    for (std::string row; std::getline(rows, row);) {
        const std::size_t task = row.find('_'), bar = row.find('|');
        if (task == std::string::npos || bar == std::string::npos || bar < task) continue;
        const std::string number = row.substr(task + 1, bar - task - 1);
        std::size_t known = 0;
        std::from_chars(number.data(), number.data() + number.size(), known);
        if (!one.states.contains(known)) note_state(one, number, std::string_view(row).substr(bar + 1));
    }
}

enum class TaskKind : std::uint8_t { Running, Waiting, Ended };

TaskKind kind_of(const std::string& state) {
    for (const char* running : {"RUNNING", "COMPLETING", "CONFIGURING", "STAGE_OUT", "SIGNALING", "SUSPENDED", "STOPPED"})
        if (state == running) return TaskKind::Running;
    for (const char* waiting : {"PENDING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED", "RESV_DEL_HOLD", "SPECIAL_EXIT", "RESIZING", kHeld})
        if (state == waiting) return TaskKind::Waiting;
    return TaskKind::Ended;
}

void take_in(const Submission& one, SlurmQueue& queue) {
    for (std::size_t task = 1; task <= one.tasks.size(); ++task) {
        const auto& chunks = one.tasks[task - 1];
        for (const std::uint64_t chunk : chunks) { // what an earlier submission came to with them is past
            queue.unknown.erase(chunk);
            for (auto& [state, of_state] : queue.ended) of_state.erase(chunk);
        }
        const auto state = one.states.find(task);
        if (state == one.states.end()) {
            queue.unknown.insert(chunks.begin(), chunks.end());
        } else if (const TaskKind kind = kind_of(state->second); kind == TaskKind::Ended) {
            queue.ended[state->second].insert(chunks.begin(), chunks.end());
        } else {
            ++(kind == TaskKind::Running ? queue.running : queue.waiting);
            if (state->second == kHeld) queue.held_jobs.insert(one.id);
            queue.chunks.insert(chunks.begin(), chunks.end());
        }
    }
}

/// What a state means to somebody who wants the runs.
const char* meaning_of(const std::string& state) {
    constexpr std::pair<std::string_view, const char*> kMeanings[] = {
        {"TIMEOUT", "beyond the time limit; --resume --slurm --time T asks for more"},
        {"DEADLINE", "beyond the cluster's deadline"},
        {"OUT_OF_MEMORY", "more memory than was asked for; --resume --slurm --memory MB asks for more"},
        {"NODE_FAIL", "the node failed"},
        {"BOOT_FAIL", "the node did not start"},
        {"PREEMPTED", "preempted, and not requeued"},
        {"CANCELLED", "cancelled"},
        {"FAILED", "ended with an error, which its log under slurm/logs has"},
        {"COMPLETED", "ended as if all were done"},
    };
    for (const auto& [name, meaning] : kMeanings)
        if (name == state) return meaning;
    return "as Slurm says";
}

/// Those of the chunks that miss a result: "chunks 3, 5, 6 and 4 more"; empty: none.
std::string name_chunks(const std::set<std::uint64_t>& chunks, const std::vector<std::uint64_t>& incomplete) {
    std::vector<std::uint64_t> missing;
    std::set_intersection(chunks.begin(), chunks.end(), incomplete.begin(), incomplete.end(), std::back_inserter(missing));
    std::string text;
    for (std::size_t i = 0; i < std::min(missing.size(), kMostNamed); ++i) text += fmt::format("{}{}", i == 0 ? (missing.size() == 1 ? "chunk " : "chunks ") : ", ", missing[i]);
    if (missing.size() > kMostNamed) text += fmt::format(" and {} more", missing.size() - kMostNamed);
    return text;
}

} // namespace

SlurmQueue ask_queue(const fs::path& folder) {
    SlurmQueue queue;
    for (int number = 1; number < next_submission(folder); ++number) {
        auto one = read_submission(folder, number);
        if (!one) continue;
        ask_squeue(*one, folder, queue);
        ask_sacct(*one, folder, queue);
        take_in(*one, queue);
    }
    return queue;
}

std::string queued_text(const SlurmQueue& queue) {
    std::string text = fmt::format("{} tasks running, {} waiting", queue.running, queue.waiting);
    if (!queue.held_jobs.empty()) text += fmt::format("; those that Slurm holds go on after `scontrol release {}`", fmt::join(queue.held_jobs, ","));
    return text;
}

std::string ended_text(const SlurmQueue& queue, const std::vector<std::uint64_t>& incomplete) {
    std::string text;
    for (const auto& [state, chunks] : queue.ended)
        if (const std::string named = name_chunks(chunks, incomplete); !named.empty()) text += fmt::format("slurm    {}: {}: {}\n", named, state, meaning_of(state));
    if (const std::string named = name_chunks(queue.unknown, incomplete); !named.empty())
        text += fmt::format("slurm    {}: not in the queue, and how their tasks ended is not known: {}\n", named,
                            queue.unknown_reason.empty() ? "sacct has no record of them" : queue.unknown_reason);
    return text;
}

Result<std::string> call_slurm(const char* tool, const std::vector<std::string>& arguments, const fs::path& folder) {
    const auto program = find_program(tool, "slurm-client");
    if (!program) return program.error();
    // through a file: of what a process prints only the end is kept, and a queue may be long
    const auto scratch = TemporaryFolder::make();
    if (!scratch) return scratch.error();
    const fs::path answer = scratch->path() / "answer";
    std::vector<std::string> words{"-c", "exec \"$@\" >\"$0\"", answer.string(), program->string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const auto ended = run_process("/bin/sh", words, folder, kPatience_s);
    if (!ended) return ended.error();
    const auto printed = read_file_bytes(answer);
    if (ended->exit_code == 0) return printed ? *printed : std::string();
    if (ended->timed_out) return Error{ErrorCode::ToolFailed, fmt::format("{} did not answer in {:g} s", tool, kPatience_s)};
    std::string said = ended->output + (printed ? *printed : std::string());
    while (!said.empty() && said.back() == '\n') said.pop_back();
    std::replace(said.begin(), said.end(), '\n', ' ');
    return Error{ErrorCode::ToolFailed, fmt::format("{} failed: {:.400}", tool, said)};
}

fs::path slurm_file(const fs::path& folder, int number, const char* name) { return folder / sweep_name::kSlurm / fmt::format("{}-{}", number, name); }

int next_submission(const fs::path& folder) {
    int number = 1;
    std::error_code none;
    while (fs::exists(slurm_file(folder, number, "tasks"), none)) ++number;
    return number;
}

} // namespace trocar::engine
