#include "solver/joint_tree_plan.hpp"

#include <algorithm>

namespace cairn {
namespace {

struct Link {
    int other = -1;  // body, −1: does not move
    int joint = 0;
    int side = 0;  // of the joint that this body is
};

using Links = std::vector<std::vector<Link>>;  // by body

Links links_of(const std::vector<int>& signature) {
    Links links;
    for (std::size_t i = 0; 3 * i < signature.size(); ++i) {
        for (int side = 0; side < 2; ++side) {
            const int body = signature[3 * i + 1 + side], other = signature[3 * i + 2 - side];
            if (body < 0) continue;
            if (body >= static_cast<int>(links.size())) links.resize(body + 1);
            links[body].push_back({other, static_cast<int>(i), side});
        }
    }
    return links;
}

// The bodies in the order in which leaf after leaf is taken away; the last of a tree is its middle. Bodies of loops are missing.
std::vector<int> peel(const Links& links) {
    std::vector<int> degree(links.size()), order;
    for (std::size_t i = 0; i < links.size(); ++i) {
        for (const Link& l : links[i]) degree[i] += l.other >= 0;
        if (!links[i].empty() && degree[i] <= 1) order.push_back(static_cast<int>(i));
    }
    std::vector<char> seen(links.size(), 0);
    for (int i : order) seen[i] = 1;
    for (std::size_t k = 0; k < order.size(); ++k) {
        for (const Link& l : links[order[k]]) {
            if (l.other < 0 || seen[l.other] || --degree[l.other] > 1) continue;
            seen[l.other] = 1;
            order.push_back(l.other);
        }
    }
    return order;
}

// Hangs all that joints reach from `root`, level by level. False: a loop, or a second body that does not move.
bool hang(const Links& links, TreePlan::Node root, std::vector<char>& placed, std::vector<TreePlan::Node>& nodes) {
    std::size_t next = nodes.size();
    nodes.push_back(root);
    placed[root.body] = 1;
    for (; next < nodes.size(); ++next) {
        const TreePlan::Node node = nodes[next];
        for (const Link& l : links[node.body]) {
            if (l.joint == node.joint) continue;
            if (l.other < 0 || placed[l.other]) return false;
            placed[l.other] = 1;
            nodes.push_back({l.other, static_cast<int>(next), l.joint, 1 - l.side});
        }
    }
    return true;
}

}  // namespace

TreePlan plan_tree(const std::vector<int>& signature) {
    TreePlan plan;
    for (std::size_t i = 0; i < signature.size(); i += 3)
        if (signature[i + 1] < 0 && signature[i + 2] < 0) return plan;
    const Links links = links_of(signature);
    const std::vector<int> order = peel(links);
    std::vector<char> placed(links.size(), 0);
    for (std::size_t i = 0; i < links.size(); ++i) {
        for (const Link& l : links[i]) {
            if (l.other >= 0 || placed[i]) continue;
            if (!hang(links, {static_cast<int>(i), -1, l.joint, l.side}, placed, plan.nodes)) return plan;
        }
    }
    for (std::size_t k = order.size(); k-- > 0;)
        if (!placed[order[k]] && !hang(links, {order[k], -1, -1, 0}, placed, plan.nodes)) return plan;
    plan.is_forest = true;
    for (std::size_t i = 0; i < links.size(); ++i) plan.is_forest &= links[i].empty() || placed[i];
    return plan;
}

}  // namespace cairn
