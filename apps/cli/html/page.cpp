#include "apps/cli/html/page.hpp"

#include "apps/cli/bench/order.hpp"
#include "apps/cli/bench/verdict.hpp"
#include "apps/cli/html/assets.hpp"
#include "apps/cli/html/phases.hpp"
#include "apps/cli/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace cairn::cli {

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '&':
                out += "&amp;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

namespace {

std::string text_cell(const std::string& text, const char* kind = "t") {
    return fmt::format("<td class=\"{}\">{}</td>", kind, escaped(text));
}
std::string number_cell(double value, const std::string& shown) {
    if (!std::isfinite(value)) return "<td data-v=\"NaN\">–</td>";
    return fmt::format("<td data-v=\"{:.9g}\">{}</td>", value, shown);
}
std::string count_cell(int value) {
    return value > 0 ? number_cell(value, std::to_string(value)) : "<td data-v=\"0\">default</td>";
}

struct Column {
    const char* name;
    bool is_text;
};
std::string table(const char* id, const std::vector<Column>& columns, const std::string& rows) {
    std::string html = fmt::format(
        "<input data-for=\"{0}\" placeholder=\"show rows with …\" aria-label=\"show rows with\">\n<div class=\"scroll\"><table "
        "id=\"{0}\"><thead><tr>",
        id);
    for (const Column& c : columns) html += fmt::format("<th{}>{}</th>", c.is_text ? " class=\"t\"" : "", c.name);
    return html + "</tr></thead><tbody>\n" + rows + "</tbody></table></div>\n";
}

std::string drawing(const ReportData& data, const std::string& name, const char* kind = "", const std::string& caption = "") {
    const auto found = data.drawings.find(name);
    if (found == data.drawings.end()) return {};
    return fmt::format("<figure{}>{}{}</figure>\n", *kind == '\0' ? "" : fmt::format(" class=\"{}\"", kind), found->second,
                       caption.empty() ? "" : "<figcaption>" + caption + "</figcaption>");
}

// The orders of convergence on a scene, below its panel.
std::string orders_text(const std::vector<Order>& orders, const std::string& scene) {
    std::string text;
    for (const Order& o : orders) {
        if (o.scene == scene)
            text += fmt::format("<div><b>{}</b> {}{}</div>", escaped(o.label), std::isfinite(o.order) ? "order " : "", to_text(o));
    }
    return text;
}

std::string orders_table(const std::vector<Order>& orders) {
    std::string rows;
    for (const Order& o : orders) {
        rows += "<tr>" + text_cell(o.scene) + text_cell(o.label) + number_cell(o.order, fmt::format("{:.2f}", o.order)) +
                text_cell(o.coarsest.empty() ? "" : o.coarsest + " … " + o.finest) + text_cell(o.note) +
                number_cell(o.overall, fmt::format("{:.2f}", o.overall)) + text_cell(o.metric) + "</tr>\n";
    }
    return table("orders",
                 {{"scene", true},
                  {"engine", true},
                  {"order", false},
                  {"over steps of [s]", true},
                  {"beyond", true},
                  {"over all", false},
                  {"error of", true}},
                 rows);
}

// One line for the parts that differ in their dates alone.
std::vector<std::string> machine_lines(const ReportData& data) {
    std::vector<std::string> lines;
    std::map<std::string, std::pair<std::string, int>> parts;  // the earliest date, and how many
    for (const Machine& m : data.machines) {
        const std::string text =
            fmt::format("{}, {} cores, {}; {} ({}); commit {}", m.cpu, m.cores, m.system, m.compiler, m.flags, m.commit);
        const auto [place, fresh] = parts.emplace(text, std::pair(m.date, 0));
        if (fresh) lines.push_back(text);
        place->second = {std::min(place->second.first, m.date), place->second.second + 1};
    }
    for (std::string& line : lines) {
        const auto& [date, count] = parts[line];
        line += "; " + date + (count > 1 ? fmt::format(" ({} parts)", count) : "");
    }
    return lines;
}

std::string bench_table(const ReportData& data) {
    std::string rows;
    for (const BenchRow& r : data.rows) {
        rows += "<tr>" + text_cell(r.scene) + number_cell(r.bodies, std::to_string(r.bodies)) + text_cell(label_of(r)) +
                number_cell(r.dt, r.dt_text) + count_cell(r.substeps) + count_cell(r.iterations) +
                number_cell(r.threads, std::to_string(r.threads));
        rows += r.walls.empty() ? "<td data-v=\"NaN\">–</td><td data-v=\"NaN\">–</td><td data-v=\"NaN\">–</td>"
                                : number_cell(r.wall_median(), readable_time(r.wall_median())) +
                                      number_cell(r.step_median(), readable_time(r.step_median())) +
                                      number_cell(r.spread(), fmt::format("{:.0f} %", 100 * r.spread()));
        rows += number_cell(r.error, fmt::format("{:.2e}", r.error)) +
                text_cell(r.metric + (r.unit.empty() || r.unit == "1" ? "" : " [" + r.unit + "]")) + text_cell(r.truth) +
                number_cell(r.energy_gain, fmt::format("{:.2g} %", 100 * r.energy_gain));
        rows += text_cell(r.status == "ok" ? "ok" : r.status + ": " + r.note, r.status == "ok" ? "t good" : "t bad");
        rows += "<td class=\"t\"><code>" + escaped(r.command) + "</code></td></tr>\n";
    }
    return table("runs",
                 {{"scene", true},
                  {"bodies", false},
                  {"engine", true},
                  {"dt [s]", false},
                  {"substeps", false},
                  {"iterations", false},
                  {"threads", false},
                  {"run", false},
                  {"per step", false},
                  {"spread", false},
                  {"error", false},
                  {"of", true},
                  {"truth", true},
                  {"energy gain", false},
                  {"status", true},
                  {"command", true}},
                 rows);
}

std::string held(const LimitResult& r) {
    if (!r.note.empty()) return r.note;
    if (r.held < 0) return "none";
    return fmt::format("{}{:.3g}", r.held + 1 == r.rungs ? "≥ " : "", r.value);
}
std::string stress_label(const LimitResult& r) {
    return r.solver.empty() || r.solver == "auto" ? r.engine : r.engine + " " + r.solver;
}

std::string stress_table(const ReportData& data) {
    std::string rows;
    for (const StressRow& row : data.stress) {
        const LimitResult& r = row.result;
        rows += "<tr>" + text_cell(r.limit) + text_cell(stress_label(r)) + number_cell(r.value, escaped(held(r))) + text_cell(row.unit) +
                number_cell(100.0 * (r.held + 1) / r.rungs, fmt::format("{:.0f} %", 100.0 * (r.held + 1) / r.rungs)) + text_cell(row.what) +
                text_cell(row.criterion) + text_cell(r.failed_at.empty() ? "" : fmt::format("at {:.3g}: {}", r.failed_value, r.failed_at)) +
                "<td class=\"t\"><code>" + escaped(r.failed_command.empty() ? r.held_command : r.failed_command) + "</code></td></tr>\n";
    }
    return table("limits",
                 {{"limit", true},
                  {"engine", true},
                  {"held", false},
                  {"unit", true},
                  {"of the ladder", false},
                  {"what grows", true},
                  {"criterion", true},
                  {"why not more", true},
                  {"run that shows it", true}},
                 rows);
}

// Settings of each engine as it comes.
std::vector<std::string> settings_lines(const ReportData& data) {
    std::vector<std::string> lines;
    std::set<std::string> seen;
    for (const BenchRow& r : data.rows) {
        if (r.settings.empty() || r.substeps != 0 || r.iterations != 0 || !seen.insert(label_of(r)).second) continue;
        lines.push_back(fmt::format("{} {} ({} bits): {}", label_of(r), r.version, r.precision, r.settings));
    }
    return lines;
}

}  // namespace

std::string report_page(const ReportData& data) {
    std::string html =
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, "
        "initial-scale=1\">\n";
    html += fmt::format(
        "<title>Cairn: run time against error</title>\n<style>{}</style>\n</head>\n<body><main>\n<h1>Run time against error</h1>\n",
        kReportStyle);
    const std::vector<std::string> scenes = scenes_of(data.rows);
    html += fmt::format(
        "<p>{} scenes, {} cases. Errors come from the states alone, against closed forms, references integrated beside the runs, and what "
        "every exact motion keeps. Lower and further left is better.</p>\n",
        scenes.size(), data.rows.size());
    for (const std::string& line : machine_lines(data)) html += "<p class=\"dim\">" + escaped(line) + "</p>\n";
    html += "<h2>What the others do better</h2>\n";
    const std::vector<std::string> wins = wins_of_others(data.rows);
    if (wins.empty()) html += "<p>In no case was another engine faster and no less accurate at the same step.</p>\n";
    html += "<ul>\n";
    for (const std::string& win : wins) html += "<li>" + escaped(win) + "</li>\n";
    for (const std::string& line : faster_others(data.rows)) html += "<li>" + escaped(line) + "</li>\n";
    html += "</ul>\n";
    html += "<p>Scenes in which an engine has a point on the Pareto front (nothing is both faster and more accurate): ";
    std::vector<std::string> counts;
    for (const auto& [label, count] : front_counts(data.rows)) counts.push_back(fmt::format("{} {}", escaped(label), count));
    html += fmt::format("{}.</p>\n", fmt::join(counts, ", "));
    html += "<h2>Settings</h2>\n<ul class=\"dim\">\n";
    for (const std::string& line : settings_lines(data)) html += "<li>" + escaped(line) + "</li>\n";
    html += "</ul>\n<h2>Work against precision</h2>\n";
    if (data.drawings.empty()) html += "<p>No gnuplot was found: the plots are left out.</p>\n";
    const std::vector<Order> orders = orders_of(data.rows);
    if (!orders.empty()) {
        html += fmt::format(
            "<p>Orders of convergence p, error ~ dt<sup>p</sup>: over the steps along which the error falls, above {:.0e}.</p>\n",
            kOrderFloor);
    }
    if (const std::vector<std::string> curves = curves_compared(with_paths(data.rows)); !curves.empty()) {
        html += "<ul>\n";
        for (const std::string& line : curves) html += "<li>" + escaped(line) + "</li>\n";
        html += "</ul>\n";
    }
    html += "<div class=\"plots\">\n";
    for (const std::string& scene : scenes_of(with_paths(data.rows)))
        html += drawing(data, "scene-" + scene, "", orders_text(orders, scene));
    html += "</div>\n";
    if (!orders.empty()) html += "<h2>Orders of convergence</h2>\n" + orders_table(orders);
    html += "<h2>Scaling</h2>\n<div class=\"wide\">" + drawing(data, "scaling", "wide") + drawing(data, "threads", "wide") + "</div>\n";
    if (const std::string bars = phase_bars(data.rows); !bars.empty()) {
        html += "<h2>Where the time goes</h2>\n<p>Cairn's step of 1/60 s by its stages, from one more run with its clock on.</p>\n" + bars;
    }
    if (!data.stress.empty()) {
        html += "<h2>Limits of stability</h2>\n<div class=\"wide\">" + drawing(data, "stress", "wide") + "</div>\n" + stress_table(data);
    }
    html += "<h2>All runs</h2>\n" + bench_table(data);
    html += fmt::format("</main>\n<script>{}</script>\n</body>\n</html>\n", kReportScript);
    return html;
}

std::string report_markdown(const ReportData& data, const std::string& figures) {
    std::string md;
    for (const std::string& line : machine_lines(data)) md += line + "\n\n";
    md += "### What the others do better\n\n";
    const std::vector<std::string> wins = wins_of_others(data.rows);
    for (const std::string& win : wins) md += "- " + win + "\n";
    for (const std::string& line : faster_others(data.rows)) md += "- " + line + "\n";
    if (wins.empty()) md += "\nIn no case was another engine faster and no less accurate at the same step.\n";
    md += "\nScenes with a point on the Pareto front: ";
    std::vector<std::string> counts;
    for (const auto& [label, count] : front_counts(data.rows)) counts.push_back(fmt::format("{} {}", label, count));
    md += fmt::format("{}.\n\nSettings:\n\n", fmt::join(counts, ", "));
    for (const std::string& line : settings_lines(data)) md += "- " + line + "\n";
    // Errors and times at each engine's defaults and the step that games use.
    const std::vector<std::string> labels = labels_of(data.rows);
    md += fmt::format("\n### Error (time of a step) at 1/60 s, each engine's defaults\n\n| scene | error of | {} |\n| --- | --- |{}\n",
                      fmt::join(labels, " | "), [&] {
                          std::string dashes;
                          for (std::size_t k = 0; k < labels.size(); ++k) dashes += " --- |";
                          return dashes;
                      }());
    for (const std::string& scene : scenes_of(data.rows)) {
        std::string of;
        std::map<std::string, std::string> cells;
        for (const BenchRow& r : data.rows) {
            if (r.scene != scene || r.dt_text != "1/60" || r.substeps != 0 || r.iterations != 0) continue;
            if (!r.metric.empty()) of = r.metric + (r.unit.empty() || r.unit == "1" ? "" : " [" + r.unit + "]");
            std::string cell = r.walls.empty() ? r.status : fmt::format("{:.2g} ({})", r.error, readable_time(r.step_median()));
            if (r.status == "failed") cell = "**F** " + cell;
            cells[label_of(r)] = cell;
        }
        if (cells.empty()) continue;
        md += fmt::format("| {} | {} |", scene, of);
        for (const std::string& label : labels) md += " " + cells[label] + " |";
        md += "\n";
    }
    if (const std::vector<Order> orders = orders_of(data.rows); !orders.empty()) {
        md += "\n### Orders of convergence\n\n| scene | engine | order | error of |\n| --- | --- | --- | --- |\n";
        for (const Order& o : orders) md += fmt::format("| {} | {} | {} | {} |\n", o.scene, o.label, to_text(o), o.metric);
    }
    if (const std::vector<std::string> curves = curves_compared(with_paths(data.rows)); !curves.empty()) {
        md += "\n### Curves of error over time\n\n";
        for (const std::string& line : curves) md += "- " + line + "\n";
    }
    if (!data.stress.empty()) {
        std::vector<std::string> limits, engines;
        std::map<std::pair<std::string, std::string>, const StressRow*> at;
        for (const StressRow& row : data.stress) {
            const std::string label = stress_label(row.result);
            if (std::find(limits.begin(), limits.end(), row.result.limit) == limits.end()) limits.push_back(row.result.limit);
            if (std::find(engines.begin(), engines.end(), label) == engines.end()) engines.push_back(label);
            at[{row.result.limit, label}] = &row;
        }
        md += fmt::format("\n### Limits of stability (highest rung held)\n\n| limit | what grows | criterion | {} |\n| --- | --- | --- |",
                          fmt::join(engines, " | "));
        for (std::size_t k = 0; k < engines.size(); ++k) md += " --- |";
        for (const std::string& limit : limits) {
            const StressRow* any = nullptr;
            std::string cells;
            for (const std::string& engine : engines) {
                const auto found = at.find({limit, engine});
                cells += fmt::format(" {} |", found == at.end() ? "" : held(found->second->result));
                if (found != at.end()) any = found->second;
            }
            md += fmt::format("\n| {} | {}{} | {} |{}", limit, any->what, any->unit.empty() ? "" : fmt::format(" [{}]", any->unit),
                              any->criterion, cells);
        }
        md += "\n";
    }
    if (!figures.empty()) {
        md += fmt::format("\n![Time of a step over bodies]({0}/scaling.svg)\n", figures);
        if (!data.stress.empty()) md += fmt::format("\n![Share of each ladder that is held]({0}/stress.svg)\n", figures);
        for (const char* scene : {"double_pendulum", "slide_stop", "bounce", "stack_10"}) {
            if (std::any_of(data.rows.begin(), data.rows.end(), [&](const BenchRow& r) { return r.scene == scene; }))
                md += fmt::format("\n![Error over time: {1}]({0}/scene-{1}.svg)\n", figures, scene);
        }
    }
    return md;
}

}  // namespace cairn::cli
