// The project's sources as the structure tests see them: paths relative to the root, lines, quoted and angled includes.
#pragma once

#include <map>
#include <string>
#include <vector>

struct SourceFile {
    std::string path;  // relative to the root, with '/'
    std::string room;  // "base" for engine/base, else the first folder: collision, solver, engine, apps, tests
    int line_count = 0;
    std::vector<std::string> project_includes;  // #include "..."
    std::vector<std::string> system_includes;   // #include <...>
};

// Every .hpp and .cpp of the rooms, by path.
using SourceTree = std::map<std::string, SourceFile>;

std::string room_of(const std::string& path);
SourceFile parse_source(const std::string& path, const std::string& text);
SourceTree read_source_tree(const std::string& root);

// The laws, each as the list of what breaks it, one line per breach; empty: kept.
std::vector<std::string> missing_includes(const SourceTree& tree);    // quoted includes name a file of the project from its root
std::vector<std::string> forbidden_includes(const SourceTree& tree);  // base ← {collision, solver} ← engine ← apps ← tests
std::vector<std::string> fcl_leaks(const SourceTree& tree);           // only collision/fcl_* see <fcl/...> and <ccd/...>, directly or not
std::vector<std::string> include_cycles(const SourceTree& tree);
std::vector<std::string> oversized_files(const SourceTree& tree, int limit);
