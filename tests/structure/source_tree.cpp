#include "tests/structure/source_tree.hpp"

#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>

namespace {

bool starts_with(const std::string& text, const std::string& prefix) {
    return text.compare(0, prefix.size(), prefix) == 0;
}

// Rooms that each room may include, itself among them.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"base", {"base"}},
    {"collision", {"base", "collision"}},
    {"solver", {"base", "solver"}},
    {"engine", {"base", "collision", "solver", "engine"}},
    {"apps", {"base", "collision", "solver", "engine", "apps"}},
    {"tests", {"base", "collision", "solver", "engine", "apps", "tests"}},
};

bool includes_fcl(const SourceFile& file) {
    for (const std::string& include : file.system_includes)
        if (starts_with(include, "fcl/") || starts_with(include, "ccd/")) return true;
    return false;
}

// Calls visit(file) for every file that `path` includes, directly or not.
void visit_included(const SourceTree& tree, const std::string& path, const std::function<void(const SourceFile&)>& visit) {
    std::set<std::string> seen{path};
    std::vector<std::string> open{path};
    while (!open.empty()) {
        const std::string current = open.back();
        open.pop_back();
        for (const std::string& include : tree.at(current).project_includes) {
            const auto found = tree.find(include);
            if (found == tree.end() || !seen.insert(include).second) continue;
            visit(found->second);
            open.push_back(include);
        }
    }
}

}  // namespace

std::string room_of(const std::string& path) {
    if (starts_with(path, "engine/base/")) return "base";
    return path.substr(0, path.find('/'));
}

SourceFile parse_source(const std::string& path, const std::string& text) {
    SourceFile file;
    file.path = path;
    file.room = room_of(path);
    std::istringstream lines(text);
    std::string line;
    while (std::getline(lines, line)) {
        ++file.line_count;
        const std::size_t hash = line.find_first_not_of(" \t");
        if (hash == std::string::npos || line[hash] != '#') continue;
        const std::size_t word = line.find_first_not_of(" \t", hash + 1);
        if (word == std::string::npos || line.compare(word, 7, "include") != 0) continue;
        const std::size_t open = line.find_first_of("\"<", word);
        if (open == std::string::npos) continue;
        const bool quoted = line[open] == '"';
        const std::size_t close = line.find(quoted ? '"' : '>', open + 1);
        if (close == std::string::npos) continue;
        (quoted ? file.project_includes : file.system_includes).push_back(line.substr(open + 1, close - open - 1));
    }
    return file;
}

SourceTree read_source_tree(const std::string& root) {
    namespace fs = std::filesystem;
    SourceTree tree;
    for (const char* folder : {"engine", "collision", "solver", "apps", "tests"}) {
        if (!fs::exists(fs::path(root) / folder)) continue;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(fs::path(root) / folder)) {
            if (!entry.is_regular_file() || (entry.path().extension() != ".hpp" && entry.path().extension() != ".cpp")) continue;
            std::ifstream in(entry.path());
            std::ostringstream text;
            text << in.rdbuf();
            const std::string path = entry.path().lexically_relative(root).generic_string();
            tree[path] = parse_source(path, text.str());
        }
    }
    return tree;
}

std::vector<std::string> missing_includes(const SourceTree& tree) {
    std::vector<std::string> breaches;
    for (const auto& [path, file] : tree)
        for (const std::string& include : file.project_includes)
            if (tree.count(include) == 0) breaches.push_back(path + " includes \"" + include + "\", which is no file under the root");
    return breaches;
}

std::vector<std::string> forbidden_includes(const SourceTree& tree) {
    std::vector<std::string> breaches;
    for (const auto& [path, file] : tree) {
        const std::set<std::string>& allowed = kMayInclude.at(file.room);
        for (const std::string& include : file.project_includes)
            if (allowed.count(room_of(include)) == 0) breaches.push_back(path + " includes " + include);
    }
    return breaches;
}

std::vector<std::string> fcl_leaks(const SourceTree& tree) {
    std::vector<std::string> breaches;
    for (const auto& [path, file] : tree) {
        if (starts_with(path, "collision/fcl_")) continue;
        if (includes_fcl(file)) breaches.push_back(path + " includes FCL or libccd");
        // Tests of an fcl_ header see what it sees; nothing else may.
        if (file.room == "tests") continue;
        visit_included(tree, path, [&, &from = path](const SourceFile& included) {
            if (includes_fcl(included)) breaches.push_back(from + " sees FCL or libccd through " + included.path);
        });
    }
    return breaches;
}

std::vector<std::string> include_cycles(const SourceTree& tree) {
    std::vector<std::string> breaches;
    for (const auto& [path, file] : tree)
        visit_included(tree, path, [&, &from = path](const SourceFile& included) {
            for (const std::string& include : included.project_includes)
                if (include == from) breaches.push_back(from + " includes itself through " + included.path);
        });
    return breaches;
}

std::vector<std::string> oversized_files(const SourceTree& tree, int limit) {
    std::vector<std::string> breaches;
    for (const auto& [path, file] : tree)
        if (file.line_count > limit) breaches.push_back(path + " has " + std::to_string(file.line_count) + " lines");
    return breaches;
}
