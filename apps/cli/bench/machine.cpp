#include "apps/cli/bench/machine.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <cstdio>
#include <ctime>
#include <fstream>
#include <thread>

namespace cairn::cli {

namespace {

std::string first_line_of(const std::string& command) {
    std::FILE* pipe = ::popen(command.c_str(), "r");
    if (pipe == nullptr) return {};
    char line[256] = "";
    const bool read = std::fgets(line, sizeof line, pipe) != nullptr;
    ::pclose(pipe);
    std::string text = read ? line : "";
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text;
}

std::string cpu_model() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);) {
        if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
    }
    return "unknown";
}

std::string commit() {
    const std::string git = "git -C '" CAIRN_SOURCE_FOLDER "' ";
    const std::string hash = first_line_of(git + "rev-parse --short=12 HEAD 2>/dev/null");
    if (hash.empty()) return "unknown";
    return first_line_of(git + "status --porcelain --untracked-files=no 2>/dev/null").empty() ? hash : hash + "+";
}

}  // namespace

Machine this_machine() {
    Machine m;
    m.cpu = cpu_model();
    m.cores = static_cast<int>(std::thread::hardware_concurrency());
    utsname names{};
    if (::uname(&names) == 0) m.system = fmt::format("{} {} {}", names.sysname, names.release, names.machine);
    m.compiler = CAIRN_COMPILER;
    m.flags = CAIRN_FLAGS;
    m.commit = commit();
    const std::time_t now = std::time(nullptr);
    char text[32] = "";
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
    m.date = text;
    return m;
}

}  // namespace cairn::cli
