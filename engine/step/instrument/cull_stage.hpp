// Image-space culling of the exact stage's candidates: whether it runs at all, on what, and what came of it.
#pragma once

#include "collision/culling/cull_twin.hpp"
#include "collision/search/interruptible_search.hpp"
#include "engine/prepare/model.hpp"
#include "engine/step/instrument/cull_worker.hpp"
#include "engine/state/step_report.hpp"
#include "engine/time/clock.hpp"
#include "engine/time/cull_cost.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// What culled in a step.
enum class CulledBy : std::uint8_t { Nobody, CpuReference, Device };

/// What it costs and saves per candidate before this was measured, and in modes where no clock decides. From `bench chromatic` on two
/// shared cores: a pair of triangles culled by the CPU reference 1 to 3 us, a candidate tested 60 ns; a graphics card is taken to need 3 ms a
/// draw.
inline constexpr CullCostModel::Rates kCpuReferenceRates{.culling_s = 1e-4, .culling_s_per_item = 2e-6, .test_s_per_item = 6e-8, .dropped = 0.5};
inline constexpr CullCostModel::Rates kDeviceRates{.culling_s = 3e-3, .culling_s_per_item = 5e-8, .test_s_per_item = 6e-8, .dropped = 0.5};
/// Mode Work: units of a grant for continuous tests that culling takes, per candidate; kCpuReferenceRates as integers.
inline constexpr std::uint64_t kTestsPerCulledItem = 33;
/// Pixels a side, the same for all: the CPU reference and a device then give the same bits.
inline constexpr int kCullResolution = 256;
/// Candidates that are culled without a list having to grow: several times those of the demo scene's steps.
inline constexpr std::size_t kReservedCullCandidates = std::size_t{1} << 17;
/// Pairs of triangles in the draws by which a device's rates are measured before the first step: one that is nearly nothing, one that is
/// like a step's.
inline constexpr std::size_t kProbePairs[] = {16, 2048};

class CullStage final : public collision::StageTwo {
public:
    explicit CullStage(Culling choice) noexcept;

    /// Reserves memory at the start, so that culling allocates nothing in any step: for kReservedCullCandidates, and surfaces of so many
    /// triangles. Nothing where the scene never culls.
    void reserve(std::size_t triangles_a, std::size_t triangles_b);
    /// A device in place of the CPU reference. It gets a thread of its own, and draws something: the first draw makes a driver translate its
    /// shaders; from the next ones its rates are measured, which hold under a budget of time in place of the declared ones.
    void set_device(std::unique_ptr<collision::CullBackend> device);

    /// Shall the next search cull its candidates? Forced by the scene, or predicted to pay and to fit.
    /// items    candidates that are expected
    /// budget   nullptr: the search runs whatever it costs; only what the scene forces is culled then
    [[nodiscard]] bool wanted(std::size_t items, StepBudget* budget);
    /// What happened since the last call goes into the report.
    void tell(StepReport& report);
    /// Devices that failed, in the order in which they did.
    [[nodiscard]] const std::vector<std::string>& notes() const noexcept { return notes_; }

    void begin(const collision::SurfacePair& pair, const collision::CandidateLists& candidates, const collision::PairOptions& options,
               WorkBudget& budget) override;
    void poll() override;
    [[nodiscard]] bool is_apart(std::size_t candidate) const noexcept override;
    void end() override;

private:
    [[nodiscard]] bool forced() const noexcept { return choice_ == Culling::Cpu || choice_ == Culling::OpenGl; }
    void cull_on_cpu();
    void take_answer();
    void note_answer(double seconds);
    void give_up_device(const Error& error);
    void probe_device();
    void learn_probes();
    [[nodiscard]] bool device_is_busy();

    /// A draw of something made up.
    struct Probe {
        std::size_t items = 0;
        double seconds = 0.0;
    };

    Culling choice_;
    std::size_t triangles_a_ = 0, triangles_b_ = 0; // that memory is reserved for
    std::vector<Probe> probes_;                     // not yet learnt
    std::vector<std::string> notes_;
    collision::CandidateCuller culler_;
    collision::CullSnapshot snapshot_;
    collision::CpuCullBackend reference_;
    std::unique_ptr<CullWorker> worker_;
    CullCostModel cost_;
    BudgetMode mode_ = BudgetMode::Exact;
    bool waiting_ = false;       // for the device
    bool answered_ = false;      // snapshot_.apart holds
    std::size_t late_items_ = 0; // of a draw whose answer was dropped and whose cost is not known yet
    std::size_t items_ = 0;      // candidates of the search at hand
    std::size_t apart_ = 0;      // of them
    double culling_s_ = 0.0;     // of the CPU reference, within the search at hand
    StopWatch since_begin_;

    struct Tally {
        CulledBy by = CulledBy::Nobody;
        std::uint64_t items = 0, apart = 0;
        unsigned late = 0, left_out = 0;
    } tally_;
};

} // namespace trocar::engine
