// The report as one HTML file that needs nothing else: no network, no other file.
#pragma once

#include "apps/cli/bench/results.hpp"
#include "apps/cli/stress/stress_file.hpp"

#include <map>
#include <string>
#include <vector>

namespace cairn::cli {

struct ReportData {
    std::vector<BenchRow> rows;
    std::vector<Machine> machines;
    std::vector<StressRow> stress;
    std::map<std::string, std::string> drawings;  // SVG; "scene-NAME" for each scene, "scaling", "threads", "stress"; may be empty
};

// With <, >, & and " as HTML wants them.
std::string escaped(const std::string& text);

std::string report_page(const ReportData& data);

// The part of docs/benchmarks.md that the command writes: machine, losses, tables.
std::string report_markdown(const ReportData& data, const std::string& figures);

}  // namespace cairn::cli
