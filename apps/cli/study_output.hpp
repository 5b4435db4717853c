// What becomes of a study's report.
#pragma once

#include "apps/cli/study.hpp"

#include <string>

namespace cairn::cli {

// For a terminal.
std::string study_text(const StudyReport& report);

// NAME.csv of every table, NAME.dat and NAME.gp of every figure into the folder, and NAME.png by gnuplot. Returns what the user should know
// (gnuplot missing), or nothing. Throws Error if a file cannot be written.
std::string write_study_files(const StudyReport& report, const std::string& folder);

// docs/sheet.md and docs/slides.md from all reports; pictures are expected in FOLDER/sheet.
void write_study_pages(const std::vector<StudyReport>& reports, const std::string& folder);

}  // namespace cairn::cli
