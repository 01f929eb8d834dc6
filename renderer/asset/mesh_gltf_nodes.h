// The node hierarchy: which meshes a scene shows, and where.
#ifndef PELT_RENDERER_ASSET_MESH_GLTF_NODES_H
#define PELT_RENDERER_ASSET_MESH_GLTF_NODES_H

#include <tiny_gltf.h>

#include <array>
#include <cmath>
#include <vector>

#include "renderer/asset/mesh_gltf_guard.h"

namespace pelt {

using matrix = std::array<double, 16>; // column-major, affine

constexpr matrix IDENTITY = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

struct instance {
    int mesh, node; // node -1: the file has no nodes
    matrix object_from_mesh;
};

inline matrix multiply(const matrix &a, const matrix &b) {
    matrix c{};
    for (std::size_t column = 0; column < 4; column++)
        for (std::size_t row = 0; row < 4; row++)
            for (std::size_t k = 0; k < 4; k++)
                c[column * 4 + row] += a[k * 4 + row] * b[column * 4 + k];
    return c;
}

inline void check_length(const std::vector<double> &values, std::size_t length, const char *name,
                         int node) {
    if (!values.empty() && values.size() != length)
        REFUSE("node %d has a %s of %zu numbers instead of %zu", node, name, values.size(), length);
}

inline matrix local_matrix(const tinygltf::Node &node, int index) {
    check_length(node.matrix, 16, "matrix", index);
    check_length(node.translation, 3, "translation", index);
    check_length(node.rotation, 4, "rotation", index);
    check_length(node.scale, 3, "scale", index);
    matrix m = IDENTITY;
    if (!node.matrix.empty()) {
        for (std::size_t i = 0; i < 16; i++)
            m[i] = node.matrix[i];
        if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
            REFUSE("node %d has a matrix that is not affine", index);
        return m;
    }
    if (!node.rotation.empty()) {
        double q[4], length = 0;
        for (std::size_t i = 0; i < 4; i++)
            length += node.rotation[i] * node.rotation[i];
        length = std::sqrt(length);
        if (!(length > 0) || !std::isfinite(length))
            REFUSE("node %d has a rotation without direction", index);
        for (std::size_t i = 0; i < 4; i++)
            q[i] = node.rotation[i] / length;
        double x = q[0], y = q[1], z = q[2], w = q[3];
        m = {1 - 2 * (y * y + z * z),
             2 * (x * y + z * w),
             2 * (x * z - y * w),
             0,
             2 * (x * y - z * w),
             1 - 2 * (x * x + z * z),
             2 * (y * z + x * w),
             0,
             2 * (x * z + y * w),
             2 * (y * z - x * w),
             1 - 2 * (x * x + y * y),
             0,
             0,
             0,
             0,
             1};
    }
    for (std::size_t column = 0; !node.scale.empty() && column < 3; column++)
        for (std::size_t row = 0; row < 3; row++)
            m[column * 4 + row] *= node.scale[column];
    for (std::size_t row = 0; !node.translation.empty() && row < 3; row++)
        m[12 + row] = node.translation[row];
    return m;
}

// The nodes to begin from: those of the default scene, else of the first; without scenes, those
// that are nobody's child.
inline std::vector<int> root_nodes(const tinygltf::Model &model) {
    if (!model.scenes.empty()) {
        if (model.defaultScene >= 0 && std::size_t(model.defaultScene) >= model.scenes.size())
            REFUSE("the default scene is %d; there are %zu", model.defaultScene,
                   model.scenes.size());
        return model.scenes[model.defaultScene < 0 ? 0 : std::size_t(model.defaultScene)].nodes;
    }
    std::vector<bool> is_child(model.nodes.size());
    for (const tinygltf::Node &node : model.nodes)
        for (int child : node.children)
            if (child >= 0 && std::size_t(child) < model.nodes.size())
                is_child[std::size_t(child)] = true;
    std::vector<int> roots;
    for (std::size_t i = 0; i < model.nodes.size(); i++)
        if (!is_child[i])
            roots.push_back(int(i));
    return roots;
}

// Every mesh that the scene shows, in the file's order. glTF's hierarchy is a strict tree: a node
// that is reached twice is a cycle or a shared child, both are refused, and so the walk visits each
// node at most once, however deep it goes. Where a mesh is skinned glTF ignores the transform of
// its node. `globals` and `in_scene`, where they are wanted, receive the transform of every node of
// the scene and whether it is one.
inline std::vector<instance> find_instances(const tinygltf::Model &model,
                                            std::vector<matrix> *globals = nullptr,
                                            std::vector<bool> *in_scene = nullptr) {
    std::vector<instance> found;
    if (globals)
        globals->assign(model.nodes.size(), IDENTITY);
    if (model.nodes.empty()) {
        for (std::size_t i = 0; i < model.meshes.size(); i++)
            found.push_back({int(i), -1, IDENTITY});
        return found;
    }
    struct visit {
        int node;
        matrix object_from_parent;
    };
    std::vector<visit> stack;
    std::vector<bool> seen(model.nodes.size());
    auto push = [&](const std::vector<int> &nodes, const matrix &m) {
        for (std::size_t i = nodes.size(); i-- > 0;)
            stack.push_back({nodes[i], m});
        // A node that is listed often would fill the stack before it is visited twice.
        if (stack.size() > model.nodes.size())
            REFUSE("the node hierarchy is not a tree: some node is listed twice");
    };
    push(root_nodes(model), IDENTITY);
    while (!stack.empty()) {
        visit at = stack.back();
        stack.pop_back();
        if (at.node < 0 || std::size_t(at.node) >= model.nodes.size())
            REFUSE("the scene refers to node %d; there are %zu", at.node, model.nodes.size());
        if (seen[std::size_t(at.node)])
            REFUSE("the node hierarchy is not a tree: node %d is reached twice", at.node);
        seen[std::size_t(at.node)] = true;
        const tinygltf::Node &node = model.nodes[std::size_t(at.node)];
        matrix m = multiply(at.object_from_parent, local_matrix(node, at.node));
        if (globals)
            (*globals)[std::size_t(at.node)] = m;
        if (node.mesh >= 0) {
            if (std::size_t(node.mesh) >= model.meshes.size())
                REFUSE("node %d shows mesh %d; there are %zu", at.node, node.mesh,
                       model.meshes.size());
            found.push_back({node.mesh, at.node, node.skin >= 0 ? IDENTITY : m});
        }
        push(node.children, m);
    }
    if (in_scene)
        *in_scene = seen;
    return found;
}

} // namespace pelt

#endif
