// `cairn study`: the exercises of a course sheet on sequential impulses, each an experiment that is run when it is asked for.
//
// A study fills a StudyReport: prose, tables and figures in reading order, and a verdict whose numbers it has computed. What becomes of the
// report (text, CSV and plots, the pages of docs/) is the business of study_output.hpp.
#pragma once

#include "engine/base/math.hpp"

#include <array>
#include <deque>
#include <string>
#include <vector>

namespace cairn::cli {

struct StudyTable {
    std::string name;  // of its CSV file
    std::string caption;
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows;
    void row(std::vector<std::string> cells) { rows.push_back(std::move(cells)); }
};

// A set of points [x, y, …] that gnuplot draws in this style, as in "lines" or "vectors".
struct StudyCurve {
    std::string title;
    std::string style;
    std::string columns = "1:2";
    std::vector<std::vector<Real>> points;  // an empty one breaks the line
};

struct StudyFigure {
    std::string name;  // of its files
    std::string caption;
    std::string commands;  // gnuplot: labels, ranges
    std::vector<StudyCurve> curves;
};

struct StudyBlock {
    enum Kind { kProse, kTable, kFigure, kVerdict } kind;
    std::size_t index;
};

struct StudyReport {
    std::string id;  // "1a"
    std::string title;
    std::string question;
    std::vector<std::string> prose;
    std::deque<StudyTable> tables;  // references to elements stay valid
    std::deque<StudyFigure> figures;
    std::string verdict;
    std::vector<StudyBlock> blocks;

    void say(const std::string& paragraph);
    StudyTable& table(const std::string& name, const std::string& caption, const std::vector<std::string>& columns);
    StudyFigure& figure(const std::string& name, const std::string& caption, const std::string& commands);
    void conclude(const std::string& sentence);
};

struct StudyTopic {
    const char* id;
    const char* title;
    const char* question;
    void (*run)(StudyReport& report, bool quick);
};

// In the order of the sheet.
const std::vector<StudyTopic>& study_topics();

// A number with three significant digits; what is below 1e-15 of anything here is rounding and said to be 0.
std::string number(Real x);

// The studies, one function a topic.
void study_constraint(StudyReport& s, bool quick);       // 1a
void study_velocity_map(StudyReport& s, bool quick);     // 1b
void study_masses(StudyReport& s, bool quick);           // 1c
void study_complementarity(StudyReport& s, bool quick);  // 1lcp
void study_iteration_clamp(StudyReport& s, bool quick);  // 1d
void study_stabilisation(StudyReport& s, bool quick);    // 1e
void study_shifted_stack(StudyReport& s, bool quick);    // 1f
void study_accumulated(StudyReport& s, bool quick);      // 1g
void study_strengths(StudyReport& s, bool quick);        // 1h
void study_friction_force(StudyReport& s, bool quick);   // 2a
void study_one_direction(StudyReport& s, bool quick);    // 2b
void study_static_friction(StudyReport& s, bool quick);  // 2c
void study_pyramid(StudyReport& s, bool quick);          // 2d
void study_limits(StudyReport& s, bool quick);           // 2e
void study_maze(StudyReport& s, bool quick);             // 2f

}  // namespace cairn::cli
