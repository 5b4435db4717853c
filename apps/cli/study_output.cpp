#include "apps/cli/study_output.hpp"

#include "engine/base/error.hpp"

#include <fmt/format.h>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace cairn::cli {

namespace {

namespace fs = std::filesystem;

void write_file(const fs::path& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw Error(path.string() + ": cannot be written: " + std::strerror(errno));
}

// Characters of UTF-8 text, for the width of columns.
std::size_t width(const std::string& text) {
    return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](unsigned char c) { return (c & 0xC0) != 0x80; }));
}

std::string csv_cell(const std::string& text) {
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
    return quoted + '"';
}

std::string csv(const StudyTable& table) {
    std::string text;
    const auto line = [&](const std::vector<std::string>& cells) {
        for (std::size_t k = 0; k < cells.size(); ++k) text += (k > 0 ? "," : "") + csv_cell(cells[k]);
        text += '\n';
    };
    line(table.columns);
    for (const std::vector<std::string>& row : table.rows) line(row);
    return text;
}

// One block of gnuplot's `index` per curve; an empty point breaks a line.
std::string figure_data(const StudyFigure& figure) {
    std::string text;
    for (const StudyCurve& curve : figure.curves) {
        text += "# " + curve.title + '\n';
        for (std::size_t k = 0; k < curve.points.size(); ++k) {
            const bool is_last = k + 1 == curve.points.size();
            if (curve.points[k].empty() && is_last) continue;  // two breaks would start the next curve
            for (const Real x : curve.points[k]) text += fmt::format("{:.6g} ", x);
            text += '\n';
        }
        text += "\n\n";
    }
    return text;
}

// Within gnuplot's single quotes.
std::string in_quotes(const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '\'' ? "''" : std::string(1, c);
    return out;
}

std::string figure_script(const StudyFigure& figure) {
    std::string text =
        fmt::format("set encoding utf8\nset terminal pngcairo size 760,440 font 'sans,10'\nset output '{0}.png'\nset grid\n{1}\nplot ",
                    figure.name, figure.commands);
    for (std::size_t k = 0; k < figure.curves.size(); ++k) {
        const StudyCurve& c = figure.curves[k];
        text += fmt::format("{}'{}.dat' index {} using {} with {} title '{}'", k > 0 ? ", \\\n     " : "", figure.name, k, c.columns,
                            c.style, in_quotes(c.title));
    }
    return text + '\n';
}

// Runs gnuplot on the script in its folder. False if there is no gnuplot.
bool run_gnuplot(const std::string& folder, const std::string& script) {
    const pid_t child = fork();
    if (child < 0) throw Error(std::string("gnuplot: no process: ") + std::strerror(errno));
    if (child == 0) {
        if (chdir(folder.c_str()) == 0) execlp("gnuplot", "gnuplot", script.c_str(), static_cast<char*>(nullptr));
        _exit(127);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 127) return false;
    if (status != 0) throw Error(folder + "/" + script + ": gnuplot failed");
    return true;
}

std::string markdown_table(const StudyTable& table) {
    std::string text = "|";
    for (const std::string& column : table.columns) text += ' ' + column + " |";
    text += "\n|";
    for (std::size_t k = 0; k < table.columns.size(); ++k) text += " --- |";
    text += '\n';
    for (const std::vector<std::string>& row : table.rows) {
        text += '|';
        for (const std::string& cell : row) text += ' ' + cell + " |";
        text += '\n';
    }
    return text;
}

std::string markdown(const StudyReport& r) {
    std::string text = fmt::format("## {} {}\n\n*{}*\n\n", r.id, r.title, r.question);
    for (const StudyBlock& block : r.blocks) {
        if (block.kind == StudyBlock::kProse) text += r.prose[block.index] + "\n\n";
        if (block.kind == StudyBlock::kTable) {
            const StudyTable& t = r.tables[block.index];
            text += t.caption + "\n\n" + markdown_table(t) + '\n';
        }
        if (block.kind == StudyBlock::kFigure) {
            const StudyFigure& f = r.figures[block.index];
            text += fmt::format("![{0}](sheet/{1}.png)\n\n{0}\n\n", f.caption, f.name);
        }
    }
    return text + "**" + r.verdict + "**\n";
}

std::string slide(const StudyReport& r) {
    std::string text = fmt::format("## {} {}\n\n{}\n\n**{}**\n", r.id, r.title, r.question, r.verdict);
    if (!r.figures.empty()) text += fmt::format("\n![](sheet/{}.png)\n", r.figures.back().name);
    return text;
}

}  // namespace

std::string study_text(const StudyReport& r) {
    std::string text = fmt::format("{} {}\n{}\n", r.id, r.title, r.question);
    for (const StudyTable& t : r.tables) {
        text += "\n  " + t.caption + '\n';
        std::vector<std::size_t> widths;
        for (const std::string& column : t.columns) widths.push_back(width(column));
        for (const auto& row : t.rows)
            for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], width(row[k]));
        const auto line = [&](const std::vector<std::string>& cells) {
            text += "  ";
            for (std::size_t k = 0; k < cells.size(); ++k) text += cells[k] + std::string(widths[k] - width(cells[k]) + 2, ' ');
            text.erase(text.find_last_not_of(' ') + 1);
            text += '\n';
        };
        line(t.columns);
        for (const auto& row : t.rows) line(row);
    }
    return text + "\n  → " + r.verdict + '\n';
}

std::string write_study_files(const StudyReport& report, const std::string& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (!fs::is_directory(folder)) throw Error(folder + ": cannot be made a folder: " + error.message());
    bool drawn = true;
    for (const StudyTable& t : report.tables) write_file(fs::path(folder) / (t.name + ".csv"), csv(t));
    for (const StudyFigure& f : report.figures) {
        write_file(fs::path(folder) / (f.name + ".dat"), figure_data(f));
        write_file(fs::path(folder) / (f.name + ".gp"), figure_script(f));
        drawn = run_gnuplot(folder, f.name + ".gp") && drawn;
    }
    return drawn ? "" : "gnuplot was not found: no pictures were drawn; run `gnuplot *.gp` in " + folder + " where it is installed";
}

void write_study_pages(const std::vector<StudyReport>& reports, const std::string& folder) {
    std::string sheet =
        "# The course sheet, answered\n\n"
        "Written by `cairn study all --write-docs docs`; do not edit. Every number and picture comes from that run, so it is true of the "
        "sources "
        "beside it; times are of one machine and vary. `cairn study TOPIC` repeats one answer. The derivations are in "
        "[theory.md](theory.md), the "
        "models and their options in [solvers.md](solvers.md); the scenes are `tests/scenes/sheet_*.json`. \"Residual\" is the natural map "
        "of the "
        "contact problem in the textbook's rows, the last change of a velocity in those of Cairn's own substep.\n";
    std::string slides =
        "---\ntitle: Sequential impulses, from the constraint to the maze\nsubtitle: Cairn, the course sheet in ten minutes\n---\n\n"
        "<!-- Written by `cairn study all --write-docs docs`. As PDF, by pandoc and weasyprint (both in Debian):\n"
        "     cd docs && pandoc slides.md -s -c slides.css --pdf-engine=weasyprint -o slides.pdf -->\n\n"
        "## The problem\n\n- Bodies with velocities v, constraints C(x) with Ċ = G v\n- Impulses Gᵀλ change velocities by M⁻¹Gᵀλ, G v by S "
        "λ\n"
        "- Contacts: 0 ≤ λ ⊥ C ≥ 0, friction bounded by μ λ\n- Sequential impulses: one row at a time, again and again\n";
    for (const StudyReport& r : reports) {
        sheet += '\n' + markdown(r);
        slides += '\n' + slide(r);
    }
    write_file(fs::path(folder) / "sheet.md", sheet);
    write_file(fs::path(folder) / "slides.md", slides);
}

}  // namespace cairn::cli
