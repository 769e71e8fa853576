#include "engine/episodes/python_policy.hpp"

#include "engine/prepare/process.hpp"
#include "engine/time/interrupt.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace trocar::engine {
namespace {

constexpr double kImportPatience_s = 120.0;           // for the modules of a policy
constexpr std::size_t kMostAnswer = std::size_t{1} << 20; // bytes of an action's line
constexpr int kLookMs = 100;                          // between looks at an interruption
constexpr int kMostLooks = 50; // at a policy that has raised, until it ends

/// argv: file, function, "check" or "play". The first line is the task, for reset(task) where the file has one; then observations come.
/// Standard output is the answers' alone: what the policy prints goes to the errors.
constexpr const char* kProgram = R"py(
import importlib.util, json, os, sys
file, name, what = sys.argv[1:4]
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
sys.path.insert(0, os.path.dirname(os.path.abspath(file)))
spec = importlib.util.spec_from_file_location("trocar_policy", file)
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
act = getattr(module, name)
if what == "check":
    sys.exit(0 if callable(act) else f"{name} is no function")
try:
    import numpy
    as_array = lambda numbers: numpy.array(numbers, dtype=numpy.float32)
except ImportError:
    as_array = list
def flat(value):
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [number for one in value for number in flat(one)]
    return [float(value)]
task = json.loads(sys.stdin.readline())
try:
    if hasattr(module, "reset"):
        module.reset(task)
    for line in sys.stdin:
        answers.write(json.dumps(flat(act(as_array(json.loads(line))))) + "\n")
        answers.flush()
except Exception as error:
    answers.write(json.dumps({"raised": f"{type(error).__name__}: {error}"}) + "\n")
    answers.flush()
    raise
)py";

Result<std::filesystem::path> find_python() {
    const char* named = std::getenv("TROCAR_PYTHON");
    return find_program(named != nullptr && *named != '\0' ? named : "python3", "python3");
}

/// What reset(task) is given.
std::string task_line(const Environment& environment, std::uint64_t seed) {
    const Task& task = environment.task();
    nlohmann::ordered_json limits = nlohmann::ordered_json::array();
    for (const InstrumentModel& one : task.model().instruments) limits.push_back({kMillimetre * one.limits.speed, one.limits.rotation});
    return nlohmann::ordered_json{{"scene", task.model().name},
                                  {"target", task.targets[environment.target()].name},
                                  {"seed", seed},
                                  {"limits", std::move(limits)},
                                  {"action_limit", task.action_limit}}
               .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
           "\n";
}

Error failed(std::string message) { return {ErrorCode::ToolFailed, std::move(message), {}, 0, 0, "--policy"}; }

class PythonPolicy final : public Policy {
public:
    PythonPolicy(pid_t child, int to, int from) : child_(child), to_(to), from_(from) {}
    PythonPolicy(const PythonPolicy&) = delete;
    PythonPolicy& operator=(const PythonPolicy&) = delete;
    ~PythonPolicy() override {
        ::close(to_);
        ::close(from_);
        ::kill(child_, SIGKILL); // it is asked nothing more
        while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {}
    }

    Result<void> act(std::span<const float> observation, std::span<double> action) override {
        std::string line = "[";
        for (const float value : observation) line += fmt::format("{}{}", line.size() > 1 ? "," : "", value);
        if (auto sent = send(line + "]\n"); !sent) return sent;
        const auto answer = receive();
        if (!answer) return answer.error();
        const auto json = nlohmann::json::parse(*answer, nullptr, false);
        if (json.is_object() && json.contains("raised")) {
            wait_for_its_end();
            return failed(fmt::format("the policy raised {:.200}", json.value("raised", "")));
        }
        bool fits = json.is_array() && json.size() == action.size();
        for (std::size_t i = 0; fits && i < action.size(); ++i) {
            fits = json[i].is_number() && std::isfinite(json[i].get<double>());
            if (fits) action[i] = json[i].get<double>();
        }
        if (!fits) return failed(fmt::format("the policy answered {:.200}; expected {} finite numbers, (devices, 2)", *answer, action.size()));
        return {};
    }

    Result<void> send(std::string_view text) {
        while (!text.empty()) {
            const ssize_t written = ::write(to_, text.data(), text.size());
            if (written < 0 && errno == EINTR) continue;
            if (written <= 0) return failed("the policy ended before the episode did; what it said stands above");
            text.remove_prefix(static_cast<std::size_t>(written));
        }
        return {};
    }

private:
    /// A line without its end.
    Result<std::string> receive() {
        for (;;) {
            if (const std::size_t end = read_.find('\n'); end != std::string::npos) {
                std::string line = read_.substr(0, end);
                read_.erase(0, end + 1);
                return line;
            }
            if (read_.size() > kMostAnswer) return failed("the policy's answer is longer than any action");
            if (interrupt_requested()) return failed("interrupted");
            pollfd one{from_, POLLIN, 0};
            if (::poll(&one, 1, kLookMs) <= 0) continue;
            char buffer[4096];
            const ssize_t count = ::read(from_, buffer, sizeof buffer);
            if (count < 0 && errno == EINTR) continue;
            if (count <= 0) return failed("the policy ended before the episode did; what it said stands above");
            read_.append(buffer, static_cast<std::size_t>(count));
        }
    }

    /// Until it has printed where it failed: what is said of that begins a line of its own then.
    void wait_for_its_end() {
        for (int look = 0; look < kMostLooks && !interrupt_requested(); ++look) {
            pollfd one{from_, POLLIN, 0};
            char rest[4096];
            if (::poll(&one, 1, kLookMs) > 0 && ::read(from_, rest, sizeof rest) == 0) return;
        }
    }

    pid_t child_;
    int to_, from_;
    std::string read_;
};

/// In the child: async-signal-safe calls only.
[[noreturn]] void become(const char* program, char* const* words, int in, int out, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() == parent && ::dup2(in, STDIN_FILENO) >= 0 && ::dup2(out, STDOUT_FILENO) >= 0) ::execv(program, words);
    _exit(127);
}

} // namespace

Result<void> check_python_function(const PythonFunction& function) {
    const auto python = find_python();
    if (!python) return python.error();
    const auto ended = run_process(*python, {"-c", kProgram, function.file.string(), function.name, "check"}, std::filesystem::path("/"), kImportPatience_s);
    if (!ended) return ended.error();
    if (ended->exit_code == 0) return {};
    std::string said = ended->output;
    while (!said.empty() && said.back() == '\n') said.pop_back();
    if (const std::size_t line = said.rfind('\n'); line != std::string::npos) said = said.substr(line + 1);
    return Error{ErrorCode::ToolFailed, ended->timed_out ? fmt::format("python3 did not import it in {:g} s", kImportPatience_s) : fmt::format("python3 refuses it: {:.300}", said),
                 function.file.string(), 0, 0, "--policy"};
}

Result<std::unique_ptr<Policy>> make_python_policy(const PythonFunction& function, const Environment& environment, std::uint64_t seed) {
    const auto python = find_python();
    if (!python) return python.error();
    std::signal(SIGPIPE, SIG_IGN); // a policy that has ended is an error of a write
    int to[2] = {-1, -1}, from[2] = {-1, -1};
    if (::pipe2(to, O_CLOEXEC) != 0) return failed(fmt::format("no pipe: {}", std::strerror(errno)));
    if (::pipe2(from, O_CLOEXEC) != 0) {
        const int reason = errno;
        for (const int end : to) ::close(end);
        return failed(fmt::format("no pipe: {}", std::strerror(reason)));
    }
    std::string words[] = {python->string(), "-c", kProgram, function.file.string(), function.name, "play"};
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const pid_t us = getpid(), child = ::fork();
    if (child == 0) become(words[0].c_str(), pointers.data(), to[0], from[1], us);
    const int reason = errno;
    ::close(to[0]);
    ::close(from[1]);
    if (child < 0) {
        ::close(to[1]);
        ::close(from[0]);
        return failed(fmt::format("python3 could not be started: {}", std::strerror(reason)));
    }
    auto policy = std::make_unique<PythonPolicy>(child, to[1], from[0]);
    if (auto begun = policy->send(task_line(environment, seed)); !begun) return begun.error();
    return std::unique_ptr<Policy>(std::move(policy));
}

} // namespace trocar::engine
