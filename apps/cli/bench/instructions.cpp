#include "apps/cli/bench/instructions.hpp"

#include "apps/cli/options.hpp"
#include "engine/base/error.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace cairn::cli {

namespace fs = std::filesystem;

bool can_count_instructions() {
    return std::system("command -v valgrind > /dev/null 2>&1") == 0;
}

double count_instructions(const BenchCase& c) {
    std::string folder = (fs::temp_directory_path() / "cairn-count-XXXXXX").string();
    if (::mkdtemp(folder.data()) == nullptr) throw Error(folder + ": cannot be made");
    std::string scene = c.file->path;
    if (scene.empty()) {
        scene = folder + "/scene.json";
        std::ofstream(scene, std::ios::binary) << c.file->text;
    }
    const EngineSettings& s = c.settings;
    // Starting the program and reading the scene take more instructions than many a run: only what World::step does is counted.
    std::string command = fmt::format(
        "valgrind --tool=callgrind --toggle-collect='cairn::World::step(double)' --callgrind-out-file='{0}/out' '{1}' run '{2}' --quiet "
        "--dt {3:.17g} --threads {4} --sleep {5}",
        folder, fs::read_symlink("/proc/self/exe").string(), scene, s.dt, s.threads, s.sleep ? 1 : 0);
    if (s.substeps) command += fmt::format(" --substeps {}", *s.substeps);
    if (s.iterations) command += fmt::format(" --iterations {}", *s.iterations);
    if (s.solver) command += fmt::format(" --solver {}", solver_name(*s.solver));
    if (s.tolerance) command += fmt::format(" --tolerance {:.17g}", *s.tolerance);
    if (s.residual_tolerance) command += fmt::format(" --residual-tolerance {:.17g}", *s.residual_tolerance);
    double count = 0;
    if (std::system((command + " > /dev/null 2>&1").c_str()) == 0) {
        std::ifstream out(folder + "/out");
        for (std::string line; std::getline(out, line);) {
            if (line.rfind("summary:", 0) == 0 || line.rfind("totals:", 0) == 0) count = std::atof(line.c_str() + line.find(':') + 1);
        }
    }
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    return count;
}

}  // namespace cairn::cli
