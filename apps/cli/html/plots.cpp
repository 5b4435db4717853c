#include "apps/cli/html/plots.hpp"

#include "apps/cli/bench/verdict.hpp"
#include "engine/base/error.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

namespace cairn::cli {

namespace fs = std::filesystem;

namespace {

// Told apart by those who do not see all colours, on white and on black (after Okabe and Ito 2008).
constexpr const char* kColours[] = {"#1f77d4", "#e66100", "#0f9d6b", "#c4498a", "#b08a00", "#7d6bd0", "#5aa9c8", "#8a8a8a"};
constexpr double kLeastError = 1e-16;  // zero has no logarithm

const char* colour(std::size_t k) {
    return kColours[k % std::size(kColours)];
}

// gnuplot takes text literally between single quotes; a quote in it is doubled.
std::string gnuplot_text(const std::string& text) {
    std::string out = "'";
    for (const char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
    return out + "'";
}

const char* const kCommon =
    "reset\nunset multiplot\nset encoding utf8\nset border lw 0.8\nset grid lc rgb '#999999' lw 0.4 dt 3\nset tics nomirror\n"
    "set key above horizontal maxrows 1 samplen 1 width 1 noenhanced\n";

void plot_lines(std::string& script, const std::vector<std::string>& plots) {
    script += "plot " + fmt::format("{}", fmt::join(plots, ", \\\n     ")) + "\n";
}

std::string tick_labels(const std::vector<std::string>& names) {
    std::string text;
    for (std::size_t i = 0; i < names.size(); ++i) text += fmt::format("{}{} {}", i == 0 ? "" : ", ", gnuplot_text(names[i]), i);
    return text;
}

class Folder {
public:
    Folder() {
        std::string name = (fs::temp_directory_path() / "cairn-plots-XXXXXX").string();
        if (::mkdtemp(name.data()) == nullptr) throw Error(name + ": cannot be made");
        path = name;
    }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    fs::path path;
};

void run_gnuplot(const std::string& script, const fs::path& folder) {
    const fs::path file = folder / "plots.gp";
    std::ofstream(file, std::ios::binary) << script;
    const std::string log = (folder / "plots.log").string();
    if (std::system(fmt::format("gnuplot '{}' > '{}' 2>&1", file.string(), log).c_str()) != 0) {
        std::ifstream text(log);
        throw Error("gnuplot: " + std::string(std::istreambuf_iterator<char>(text), {}));
    }
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) text.replace(at, from.size(), to);
}

// What is black in the drawing takes the page's colour; the prologue, which no page may hold in its middle, goes.
std::string for_page(std::string svg) {
    svg.erase(0, svg.find("<svg"));
    for (const char* black : {"'black'", "\"black\"", "'rgb(  0,   0,   0)'", "\"rgb(  0,   0,   0)\"", "'#000000'", "\"#000000\""}) {
        replace_all(svg, std::string("=") + black, "=\"currentColor\"");
    }
    return svg;
}

}  // namespace

bool can_plot() {
    return std::system("command -v gnuplot > /dev/null 2>&1") == 0;
}

std::string work_precision_script(const std::vector<BenchRow>& rows, const std::string& scene, const std::vector<std::string>& labels) {
    std::string script = kCommon, unit, metric;
    std::vector<std::string> plots;
    for (std::size_t k = 0; k < labels.size(); ++k) {
        std::vector<const BenchRow*> line;
        for (const BenchRow& row : rows) {
            if (row.scene != scene) continue;
            if (!row.metric.empty()) {
                metric = row.metric;
                unit = row.unit;
            }
            if (label_of(row) == labels[k] && row.status == "ok" && std::isfinite(row.error) && row.wall_median() > 0) line.push_back(&row);
        }
        if (line.empty()) continue;
        std::stable_sort(line.begin(), line.end(),
                         [](const BenchRow* a, const BenchRow* b) { return a->wall_median() < b->wall_median(); });
        script += fmt::format("$line{} << EOD\n", k);
        for (const BenchRow* row : line) {
            const auto [low, high] = std::minmax_element(row->walls.begin(), row->walls.end());
            script += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g}\n", 1e3 * row->wall_median(), std::max(row->error, kLeastError), 1e3 * *low,
                                  1e3 * *high);
        }
        script += "EOD\n";
        plots.push_back(fmt::format("$line{0} using 1:2:3:4 with xerrorbars pt 0 lw 0.6 lc rgb '{1}' notitle", k, colour(k)));
        plots.push_back(fmt::format("$line{0} using 1:2 with linespoints pt 7 ps 0.45 lw 1.4 lc rgb '{1}' title {2}", k, colour(k),
                                    gnuplot_text(labels[k])));
    }
    if (plots.empty()) return {};
    script += "$front << EOD\n";
    for (const BenchRow* row : pareto_front(rows, scene)) {
        script += fmt::format("{:.6g} {:.6g}\n", 1e3 * row->wall_median(), std::max(row->error, kLeastError));
    }
    script += "EOD\n";
    plots.push_back("$front using 1:2 with points pt 6 ps 1.1 lw 1.2 lc rgb 'black' title 'Pareto front'");
    const std::string of = metric + (unit.empty() || unit == "1" ? "" : " [" + unit + "]");
    script += fmt::format("set title {} noenhanced\nset xlabel 'time of the run [ms]'\nset ylabel {} noenhanced\n", gnuplot_text(scene),
                          gnuplot_text(of));
    script += "set logscale xy\nset format y '10^{%L}'\nset format x '%g'\nset offsets graph 0.05, graph 0.05, graph 0.05, graph 0.05\n";
    plot_lines(script, plots);
    return script;
}

std::string scaling_script(const std::vector<BenchRow>& rows, const std::vector<std::string>& labels) {
    std::string script = kCommon;
    std::vector<std::string> plots;
    for (std::size_t k = 0; k < labels.size(); ++k) {
        std::string data;
        for (const BenchRow& row : rows) {
            if (label_of(row) != labels[k] || row.status != "ok" || row.dt_text != "1/60" || row.substeps != 0 || row.iterations != 0)
                continue;
            if (row.step_median() > 0) data += fmt::format("{} {:.6g}\n", row.bodies, 1e3 * row.step_median());
        }
        if (data.empty()) continue;
        script += fmt::format("$line{} << EOD\n{}EOD\n", k, data);
        plots.push_back(
            fmt::format("$line{0} using 1:2 with points pt 7 ps 0.5 lc rgb '{1}' title {2}", k, colour(k), gnuplot_text(labels[k])));
    }
    if (plots.empty()) return {};
    script +=
        "set title 'All scenes, steps of 1/60 s'\nset xlabel 'bodies'\nset ylabel 'median step [ms]'\nset logscale xy\nset format '%g'\n";
    plot_lines(script, plots);
    return script;
}

std::string threads_script(const std::vector<BenchRow>& rows) {
    constexpr std::size_t kMostLines = 8;
    // Rows on several threads beside the one that differs from them in nothing else.
    std::map<const BenchRow*, std::vector<const BenchRow*>> lines;
    for (const BenchRow& one : rows) {
        if (one.threads != 1 || one.engine != "cairn" || one.wall_median() <= 0 || one.dt_text != "1/60") continue;
        for (const BenchRow& other : rows) {
            if (other.threads > 1 && other.wall_median() > 0 && id_without(other, "threads") == id_without(one, "threads"))
                lines[&one].push_back(&other);
        }
    }
    std::vector<const BenchRow*> longest;
    for (const auto& [one, others] : lines) longest.push_back(one);
    std::sort(longest.begin(), longest.end(), [](const BenchRow* a, const BenchRow* b) { return a->step_median() > b->step_median(); });
    if (longest.size() > kMostLines) longest.resize(kMostLines);
    if (longest.empty()) return {};
    int most = 1;
    std::string script = kCommon;
    std::vector<std::string> plots;
    for (std::size_t k = 0; k < longest.size(); ++k) {
        const BenchRow& one = *longest[k];
        std::vector<const BenchRow*> points = lines[&one];
        points.push_back(&one);
        std::sort(points.begin(), points.end(), [](const BenchRow* a, const BenchRow* b) { return a->threads < b->threads; });
        script += fmt::format("$line{} << EOD\n", k);
        most = std::max(most, points.back()->threads);
        for (const BenchRow* p : points) script += fmt::format("{} {:.4g}\n", p->threads, one.wall_median() / p->wall_median());
        script += "EOD\n";
        plots.push_back(fmt::format("$line{0} using 1:2 with linespoints pt 7 ps 0.6 lw 1.4 lc rgb '{1}' title {2}", k, colour(k),
                                    gnuplot_text(one.scene)));
    }
    script +=
        "set title 'Speed-up over threads, the scenes with the longest steps of 1/60 s'\nset xlabel 'threads'\nset ylabel 'time on one / "
        "time'\n"
        "set key above horizontal maxrows 2\nset xtics 1\nset yrange [0:]\n";
    script += fmt::format("set xrange [0.8:{}.2]\n", most);
    plot_lines(script, plots);
    return script;
}

std::string stress_script(const std::vector<StressRow>& rows) {
    std::vector<std::string> limits, engines;
    const auto note = [](std::vector<std::string>& list, const std::string& name) {
        if (std::find(list.begin(), list.end(), name) == list.end()) list.push_back(name);
    };
    const auto label = [](const LimitResult& r) { return r.solver.empty() || r.solver == "auto" ? r.engine : r.engine + " " + r.solver; };
    for (const StressRow& row : rows) {
        note(limits, row.result.limit);
        note(engines, label(row.result));
    }
    if (rows.empty()) return {};
    std::string script = kCommon;
    std::vector<std::string> plots;
    const double width = 0.8 / static_cast<double>(engines.size());
    for (std::size_t k = 0; k < engines.size(); ++k) {
        script += fmt::format("$bar{} << EOD\n", k);
        for (const StressRow& row : rows) {
            const LimitResult& r = row.result;
            if (label(r) != engines[k]) continue;
            const auto at = std::find(limits.begin(), limits.end(), r.limit) - limits.begin();
            script += fmt::format("{:.3f} {:.4f}\n", static_cast<double>(at) - 0.4 + (static_cast<double>(k) + 0.5) * width,
                                  100.0 * (r.held + 1) / r.rungs);
        }
        script += "EOD\n";
        plots.push_back(fmt::format("$bar{0} using 1:2:({1:.4f}) with boxes fs solid 0.9 noborder lc rgb '{2}' title {3}", k, width,
                                    colour(k), gnuplot_text(engines[k])));
    }
    script += fmt::format("set title 'Stability: share of each ladder that is held [%]'\nset yrange [0:100]\nset xrange [-0.6:{}]\n",
                          static_cast<double>(limits.size()) - 0.4);
    script += "set xtics rotate by -40 (" + tick_labels(limits) + ") noenhanced\n";
    plot_lines(script, plots);
    return script;
}

std::map<std::string, std::string> draw_svg(const std::map<std::string, std::pair<std::string, Size>>& scripts) {
    const Folder folder;
    // Numbered: scenes may have any name, files and identifiers may not.
    const auto file_of = [&folder](int k) { return (folder.path / fmt::format("drawing_{}.svg", k)).string(); };
    std::string all;
    int k = 0;
    for (const auto& [name, drawing] : scripts) {
        all += fmt::format("set terminal svg size {},{} dynamic font 'system-ui,sans-serif,12' name 'drawing_{}'\nset output {}\n",
                           drawing.second.width, drawing.second.height, k, gnuplot_text(file_of(k)));
        all += drawing.first + "unset output\n";
        ++k;
    }
    run_gnuplot(all, folder.path);
    std::map<std::string, std::string> drawn;
    k = 0;
    for (const auto& [name, drawing] : scripts) {
        std::ifstream file(file_of(k++), std::ios::binary);
        drawn[name] = for_page({std::istreambuf_iterator<char>(file), {}});
    }
    return drawn;
}

void draw_files(const std::map<std::string, std::pair<std::string, Size>>& scripts, const std::string& folder) {
    const Folder scratch;
    std::error_code ignored;
    fs::create_directories(folder, ignored);
    std::string all;
    for (const auto& [name, drawing] : scripts) {
        const auto [w, h] = drawing.second;
        const std::string path = (fs::path(folder) / name).string();
        all += fmt::format("set terminal svg size {},{} font 'sans-serif,12' background rgb 'white'\nset output {}\n", w, h,
                           gnuplot_text(path + ".svg"));
        all += drawing.first + "unset output\n";
        all += fmt::format("set terminal pngcairo size {},{} font 'sans,11'\nset output {}\n", w, h, gnuplot_text(path + ".png"));
        all += drawing.first + "unset output\n";
    }
    run_gnuplot(all, scratch.path);
}

}  // namespace cairn::cli
