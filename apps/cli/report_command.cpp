#include "apps/cli/bench/order.hpp"
#include "apps/cli/bench/verdict.hpp"
#include "apps/cli/commands.hpp"
#include "apps/cli/html/page.hpp"
#include "apps/cli/html/plots.hpp"

#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

namespace cairn::cli {

namespace fs = std::filesystem;

namespace {

struct Arguments {
    std::string folder;
    std::string out;
    std::string docs;
    bool plots = true;
};

void write_text(const fs::path& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw Error(path.string() + ": cannot be written");
}

std::map<std::string, std::pair<std::string, Size>> scripts_of(const ReportData& data) {
    std::map<std::string, std::pair<std::string, Size>> scripts;
    const auto add = [&scripts](const std::string& name, std::string script, Size size) {
        if (!script.empty()) scripts[name] = {std::move(script), size};
    };
    const std::vector<std::string> labels = labels_of(data.rows);
    const std::vector<BenchRow> rows = with_paths(data.rows);
    for (const std::string& scene : scenes_of(rows)) add("scene-" + scene, work_precision_script(rows, scene, labels), {});
    add("threads", threads_script(data.rows), {900, 480});
    add("scaling", scaling_script(data.rows, labels), {900, 480});
    add("stress", stress_script(data.stress), {1000, 480});
    return scripts;
}

// Puts the results between the two marks of the page; what is around them is written by hand.
void update_docs(const std::string& path, const ReportData& data, const std::map<std::string, std::pair<std::string, Size>>& scripts,
                 bool plots) {
    constexpr const char* kBegin = "<!-- results: begin (cairn report --docs) -->";
    constexpr const char* kEnd = "<!-- results: end -->";
    std::ifstream file(path, std::ios::binary);
    const std::string page{std::istreambuf_iterator<char>(file), {}};
    const std::size_t begin = page.find(kBegin), end = page.find(kEnd);
    if (begin == std::string::npos || end == std::string::npos || end < begin)
        throw Error("--docs: " + path + ": holds no line " + kBegin + " before one " + kEnd);
    const fs::path figures = fs::path(path).parent_path() / "figures";
    if (plots) {
        std::map<std::string, std::pair<std::string, Size>> some;
        for (const char* name : {"scaling", "stress", "scene-double_pendulum", "scene-slide_stop", "scene-bounce", "scene-stack_10"}) {
            if (const auto found = scripts.find(name); found != scripts.end()) some.insert(*found);
        }
        draw_files(some, figures.string());
    }
    write_text(path, page.substr(0, begin) + kBegin + "\n" + report_markdown(data, plots ? "figures" : "") + page.substr(end));
}

int report(const Arguments& a) {
    ReportData data;
    std::error_code error;
    if (!fs::is_directory(a.folder, error)) throw Error(a.folder + ": is no folder with results of cairn bench");
    data.rows = read_results(a.folder, data.machines);
    data.stress = read_stress(a.folder);
    const std::map<std::string, std::pair<std::string, Size>> scripts = scripts_of(data);
    const bool plots = a.plots && can_plot();
    if (plots) data.drawings = draw_svg(scripts);
    if (a.plots && !plots) fmt::print(stderr, "no gnuplot on this machine: the report has no plots\n");
    const fs::path out = a.out.empty() ? fs::path(a.folder) / "report.html" : fs::path(a.out);
    write_text(out, report_page(data));
    fmt::print("{}\n", fs::absolute(out).lexically_normal().string());
    if (!a.docs.empty()) update_docs(a.docs, data, scripts, plots);
    return kSuccess;
}

}  // namespace

void add_report_command(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("report", "Make one HTML page of the results of bench and stress");
    const std::shared_ptr<Arguments> a = std::make_shared<Arguments>();
    command->add_option("DIR", a->folder, "Folder that bench (and stress) wrote to, or one that holds the folders of its shards")
        ->required();
    command->add_option("--out", a->out, "The page; default DIR/report.html");
    command->add_option("--docs", a->docs, "Also put tables and figures into this Markdown page, between its marks");
    command->add_flag("!--no-plots", a->plots, "Leave the plots out");
    command->footer(
        "Examples:\n"
        "  cairn bench --out results && cairn stress --out results && cairn report results\n"
        "  cairn report results --docs docs/benchmarks.md");
    command->callback([a, &exit_code] { exit_code = report(*a); });
}

}  // namespace cairn::cli
