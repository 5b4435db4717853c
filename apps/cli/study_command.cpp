#include "apps/cli/commands.hpp"
#include "apps/cli/study.hpp"
#include "apps/cli/study_output.hpp"
#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

namespace cairn::cli {

namespace {

struct Arguments {
    std::vector<std::string> topics;
    std::string out;
    std::string docs;
    bool quick = false;
};

StudyReport run_topic(const StudyTopic& topic, bool quick) {
    StudyReport report;
    report.id = topic.id;
    report.title = topic.title;
    report.question = topic.question;
    topic.run(report, quick);
    return report;
}

std::vector<StudyTopic> chosen(const std::vector<std::string>& names) {
    std::vector<StudyTopic> list;
    for (const std::string& name : names) {
        std::string known = "all";
        const std::size_t before = list.size();
        for (const StudyTopic& topic : study_topics()) {
            if (name == topic.id || name == "all") list.push_back(topic);
            known.append(", ").append(topic.id);
        }
        if (list.size() == before) throw_invalid("TOPIC", name, "one of " + known);
    }
    return list;
}

int study(const Arguments& arguments) {
    if (arguments.topics.empty()) {
        for (const StudyTopic& topic : study_topics()) fmt::print("{:<5} {}: {}\n", topic.id, topic.title, topic.question);
        return kSuccess;
    }
    const bool all = arguments.topics == std::vector<std::string>{"all"};
    if (!arguments.docs.empty() && !all) throw Error("--write-docs: the pages are of all topics, so TOPIC must be all");
    std::vector<StudyReport> reports;
    std::string note;
    for (const StudyTopic& topic : chosen(arguments.topics)) {
        reports.push_back(run_topic(topic, arguments.quick));
        fmt::print("{}\n", study_text(reports.back()));
        std::fflush(stdout);
        if (!arguments.out.empty()) note = write_study_files(reports.back(), arguments.out);
        if (!arguments.docs.empty()) note = write_study_files(reports.back(), arguments.docs + "/sheet");
    }
    if (!arguments.docs.empty()) write_study_pages(reports, arguments.docs);
    if (!note.empty()) fmt::print(stderr, "{}\n", note);
    return kSuccess;
}

}  // namespace

void add_study_command(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("study", "Experiments on sequential impulses, from the constraint to the maze");
    const std::shared_ptr<Arguments> arguments = std::make_shared<Arguments>();
    command->add_option("TOPIC", arguments->topics, "Topics, or all; without any they are listed");
    command->add_option("--out", arguments->out,
                        "Write tables (CSV) and figures (data, gnuplot script, PNG if gnuplot is found) to this folder");
    command->add_option("--write-docs", arguments->docs, "With all: write sheet.md, slides.md and sheet/ to this folder");
    command->add_flag("--quick", arguments->quick, "Shorter runs: all in under two minutes");
    command->footer(
        "Examples:\n"
        "  cairn study\n"
        "  cairn study 1f 1g --out figures\n"
        "  cairn study all --quick\n"
        "  cairn study all --write-docs docs\n"
        "Bullet's rows need its adapter (CMake: CAIRN_WITH_BULLET).");
    command->callback([arguments, &exit_code] { exit_code = study(*arguments); });
}

}  // namespace cairn::cli
