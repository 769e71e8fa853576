#include "engine/episodes/play.hpp"

#include "engine/episodes/make_policy.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/report/build_facts.hpp"
#include "engine/report/episode_table.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/time/interrupt.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {
namespace {

#define TROCAR_KEY(name, unit, meaning, expression)                                                                                        \
    {                                                                                                                                      \
        {name, unit, meaning}, []([[maybe_unused]] const PlayedEpisode& e) -> OutputJson { return expression; }                            \
    }
const JsonKey<PlayedEpisode> kKeys[] = {
    TROCAR_KEY("version", "", "Of the program.", build_facts().version),
    TROCAR_KEY("commit", "", "Of the sources that it was built from; `unknown` where it was built outside of a checkout.", build_facts().commit),
    TROCAR_KEY("scene", "", "Its name.", e.scene),
    TROCAR_KEY("seed", "", "All that the episode draws follows from it.", e.seed),
    TROCAR_KEY("policy", "", "As the command line names it.", e.policy),
    TROCAR_KEY("target", "", "That was drawn.", e.target),
    TROCAR_KEY("budget", "", "Of every step.", e.budget),
    TROCAR_KEY("success", "", "The target was reached.", e.success),
    TROCAR_KEY("return", "", "Sum of the rewards.", e.reward),
    TROCAR_KEY("reward_terms", "", "The same by its terms: `progress`, `target`, `force`, `step`.",
               (OutputJson{{"progress", e.terms[0]}, {"target", e.terms[1]}, {"force", e.terms[2]}, {"step", e.terms[3]}})),
    TROCAR_KEY("length", "", "Actions until the end.", e.actions),
    TROCAR_KEY("action_limit", "", "Actions after which an episode ends.", e.action_limit),
    TROCAR_KEY("steps", "", "Of the simulation.", e.steps),
    TROCAR_KEY("seconds", "s", "Simulated.", e.seconds),
    TROCAR_KEY("remaining_m", "m", "From the tip to the target along the centreline, at the end.", e.remaining),
    TROCAR_KEY("distance_m", "m", "In a straight line, at the end.", e.distance),
    TROCAR_KEY("closest_m", "m", "The least such distance, the start included.", e.closest),
    TROCAR_KEY("largest_contact_force_n", "N", "Largest normal force at one place on a wall.", e.force),
    TROCAR_KEY("lumen_exits", "", "Instrument vertices outside the lumen, summed over the steps.", e.exits),
    TROCAR_KEY("unresolved", "", "Continuous tests that ended without a verdict.", e.unresolved),
    TROCAR_KEY("assumed", "", "Contacts that were assumed because nothing proved them absent.", e.assumed),
    TROCAR_KEY("overruns", "", "Steps that missed their budget.", e.overruns),
    TROCAR_KEY("exact_steps", "", "Steps whose answer the exact stage gave.", e.exact_steps),
    TROCAR_KEY("failure", "", "Why the simulation ended before the episode did, or null.", e.failure.empty() ? OutputJson() : OutputJson(e.failure)),
    TROCAR_KEY("state_hash", "", "Of the state at the end, 16 hexadecimal digits.", fmt::format("{:016x}", e.state_hash)),
};
#undef TROCAR_KEY

/// Values of action_table_columns().
std::string row_of(const ActionOutcome& o, double time) {
    return fmt::format("{},{},{},{},{},{},{},{},{},{}", o.action, time, o.reward, o.remaining, o.distance, o.force, o.exits, o.unresolved, o.exact_steps,
                       o.overruns);
}

void add_action(PlayedEpisode& episode, std::span<const double> action, const ActionOutcome& o, double time) {
    episode.actions = o.action;
    episode.seconds = time;
    episode.reward += o.reward;
    for (std::size_t k = 0; k < kRewardTerms; ++k) episode.terms[k] += o.terms[k];
    episode.success = o.terminated;
    episode.remaining = o.remaining, episode.distance = o.distance;
    episode.closest = std::min(episode.closest, o.distance);
    episode.force = std::max(episode.force, o.force);
    episode.exits += o.exits, episode.unresolved += o.unresolved, episode.assumed += o.assumed;
    episode.overruns += o.overruns, episode.exact_steps += o.exact_steps;
    episode.failure = o.failure;
    episode.state_hash = o.hash;
    episode.table += row_of(o, time) + "," + record_cells(action, o.hash) + "\n";
}

} // namespace

Result<PlayedEpisode> play_episode(const std::shared_ptr<const Task>& task, std::uint64_t seed, const std::string& policy, const Progress& progress) {
    Environment environment({task});
    environment.seed(seed);
    if (const auto begun = environment.reset(); !begun) return begun.error();
    const auto driver = make_policy(policy, {}, environment, seed);
    if (!driver) return driver.error();
    PlayedEpisode episode{.scene = task->model().name, .target = task->targets[environment.target()].name, .policy = policy, .seed = seed,
                          .budget = BudgetSpec{task->budget}.to_string(), .action_limit = task->action_limit,
                          .distance = environment.outcome().distance, .closest = environment.outcome().distance, .failure = {},
                          .table = action_table_header() + "," + record_columns(task->model()) + "\n"};
    std::vector<float> observation(task->observation_size());
    std::vector<double> action(2 * task->devices());
    const std::uint64_t first = environment.simulator()->state().step;
    const double start_s = environment.simulator()->state().time;
    while (!environment.outcome().terminated && !environment.outcome().truncated) {
        episode.interrupted = interrupt_requested();
        if (episode.interrupted) break;
        if (progress) progress(fmt::format("action {} of at most {}", episode.actions + 1, task->action_limit));
        environment.observe(observation);
        if (const auto acted = (*driver)->act(observation, action); !acted) {
            episode.interrupted = interrupt_requested();
            if (episode.interrupted) break;
            return acted.error();
        }
        environment.step(action);
        add_action(episode, action, environment.outcome(), environment.simulator()->state().time - start_s);
    }
    episode.steps = environment.simulator()->state().step - first;
    return episode;
}

Result<void> write_episode(const PlayedEpisode& episode, const Task& task, const EpisodeSource& source, const std::filesystem::path& folder) {
    if (auto written = write_file_atomically(folder / output_name::kActions, episode.table); !written) return written;
    // names of files may hold any bytes; JSON is UTF-8
    const std::string figures = write_keys<PlayedEpisode>(kKeys, episode).dump(2, ' ', false, OutputJson::error_handler_t::replace) + "\n";
    if (auto written = write_file_atomically(folder / output_name::kSummary, figures); !written) return written;
    const std::string files[] = {output_name::kActions, output_name::kSummary};
    return can_be_recorded(task) ? write_manifest(task, source, episode.seed, files, folder) : Result<void>();
}

std::vector<OutputTable> episode_output_tables() {
    std::vector<OutputKey> columns = action_table_columns();
    columns.push_back({"NAME.insertion_mm_s", "mm/s", "What the policy asked of the instrument NAME; taken within its limits."});
    columns.push_back({"NAME.rotation_rad_s", "rad/s", "Likewise."});
    columns.push_back({episode_record::kState, "", "Hash of the state after the action, 16 hexadecimal digits."});
    return {{"actions.csv", "`episode`: one row for each action.", std::move(columns)},
            {"summary.json of an episode", "", keys_of<PlayedEpisode>(kKeys)}};
}

} // namespace trocar::engine
