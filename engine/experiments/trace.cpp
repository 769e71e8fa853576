#include "engine/experiments/trace.hpp"

#include "engine/report/statistics.hpp"

#include <fmt/format.h>

#include <iterator>

namespace trocar::engine {

void StepTrace::add_span(const char* name, double begin_ms, double length_ms, int row) {
    fmt::format_to(std::back_inserter(events_), "{}{{\"name\":\"{}\",\"ph\":\"X\",\"pid\":1,\"tid\":{},\"ts\":{:.3f},\"dur\":{:.3f}}}",
                   events_.empty() ? "" : ",\n", name, row, 1e3 * begin_ms, 1e3 * length_ms);
}

void StepTrace::add(const StepReport& report) {
    add_span("step", now_ms_, report.ms.total, 1);
    double begin = now_ms_;
    const auto times = stage_times(report.ms);
    for (std::size_t i = 0; i < kStageCount; ++i) {
        add_span(kStageNames[i], begin, times[i], 2);
        begin += times[i];
    }
    fmt::format_to(
        std::back_inserter(events_),
        ",\n{{\"name\":\"budget\",\"ph\":\"C\",\"pid\":1,\"ts\":{:.3f},\"args\":{{\"charged_ms\":{:.6g},\"level\":{},\"open_pairs\":{},"
        "\"exact\":{}}}}}",
        1e3 * now_ms_, report.ms.budget, report.level_reached, report.pairs_open, report.exact_ran ? 1 : 0);
    now_ms_ += report.ms.total;
}

std::string StepTrace::text() const {
    return "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n"
           "{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":1,\"args\":{\"name\":\"steps\"}},\n"
           "{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":2,\"args\":{\"name\":\"stages\"}}" +
           (events_.empty() ? std::string() : ",\n" + events_) + "\n]}\n";
}

} // namespace trocar::engine
