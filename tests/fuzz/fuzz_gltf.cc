// libFuzzer target: bytes as a glTF file, through the shim and the mesh build.
//
// The shim and tinygltf are compiled into the target, so that both are instrumented. An input that
// begins with 'J' is taken as JSON text, a zero byte, and a binary chunk, and is put into a
// container: mutations then reach what lies behind the container's lengths. Anything else is a file
// as it is.
//
// Built and run by tests/fuzz/gltf.sh.
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>
#undef TINYGLTF_IMPLEMENTATION // the header would give its bodies again

#define PELT_TINYGLTF_VERSION "fuzzed"
#include "renderer/asset/mesh_gltf.cc"

extern "C" {
#include "renderer/asset/mesh_build.h"
}

namespace {

void append_le(std::vector<unsigned char> &out, std::size_t value) {
    for (int shift = 0; shift < 32; shift += 8)
        out.push_back((unsigned char)(value >> shift));
}

std::vector<unsigned char> contain(const unsigned char *data, std::size_t size) {
    const void *zero = std::memchr(data, 0, size);
    std::size_t text = zero ? std::size_t(static_cast<const unsigned char *>(zero) - data) : size;
    std::size_t binary = zero ? size - text - 1 : 0, pad = (4 - text % 4) % 4;
    binary -= binary % 4;
    std::vector<unsigned char> out = {'g', 'l', 'T', 'F'};
    append_le(out, 2);
    append_le(out, 20 + text + pad + (binary ? 8 + binary : 0));
    append_le(out, text + pad);
    append_le(out, 0x4e4f534a);
    out.insert(out.end(), data, data + text);
    out.insert(out.end(), pad, ' ');
    if (binary) {
        append_le(out, binary);
        append_le(out, 0x004e4942);
        out.insert(out.end(), data + text + 1, data + text + 1 + binary);
    }
    return out;
}

void check(bool holds) {
    if (!holds)
        __builtin_trap();
}

// The same file at a time of its first animation, where that is accepted.
void pose(const std::vector<unsigned char> &file, std::uint64_t triangles, std::uint64_t same,
          mesh *rest) {
    gltf_soup soup;
    gltf_pose at = {nullptr, 0.5};
    char message[300] = "";
    if (pelt_mesh_module.load(file.data(), file.size(), triangles, &at, &soup, message,
                              sizeof message) != GLTF_OK) {
        check(message[0] && !soup.position);
        return;
    }
    check(soup.triangle_count == same);
    mesh_soup view = {soup.triangle_count, soup.position, soup.normal, nullptr,
                      soup.has_normal,     nullptr,       nullptr};
    mesh *posed = nullptr;
    check(mesh_pose(rest, &view, "", &posed, nullptr) == STATUS_OK);
    for (std::uint32_t v = 0; v < posed->vertex_count; v++)
        for (int k = 0; k < 3; k++)
            check(std::isfinite(posed->position[v][k]) && std::isfinite(posed->normal[v][k]));
    mesh_destroy(posed);
    pelt_mesh_module.free(&soup);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char *data, std::size_t size) {
    std::vector<unsigned char> file(data, data + size);
    if (size > 0 && data[0] == 'J')
        file = contain(data + 1, size - 1);
    gltf_soup soup;
    char message[300] = "";
    constexpr std::uint64_t TRIANGLES = 20000;
    gltf_outcome outcome = pelt_mesh_module.load(file.data(), file.size(), TRIANGLES, nullptr,
                                                 &soup, message, sizeof message);
    if (outcome != GLTF_OK) {
        check(message[0] && !soup.position && !soup.images);
        return 0;
    }
    check(soup.triangle_count > 0 && soup.triangle_count <= TRIANGLES);
    mesh_soup view = {soup.triangle_count, soup.position, soup.normal, soup.uv,
                      soup.has_normal,     soup.has_uv,   soup.surface};
    mesh *built = nullptr;
    if (mesh_build(&view, "", &built, nullptr) == STATUS_OK) {
        for (std::uint32_t t = 0; t < built->triangle_count; t++) {
            check(built->surface[t] < soup.surface_count);
            for (int k = 0; k < 3; k++) {
                std::uint32_t v = built->vertex[t][k], other = built->neighbour[t][k];
                check(v < built->vertex_count && v != built->vertex[t][(k + 1) % 3]);
                check(other == MESH_NONE || (other < built->triangle_count && other != t));
                check(std::isfinite(built->corner_uv[t][k][0]) &&
                      std::isfinite(built->corner_uv[t][k][1]));
            }
        }
        for (std::uint32_t v = 0; v < built->vertex_count; v++) {
            const double *n = built->normal[v];
            check(std::fabs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-9);
        }
        pose(file, TRIANGLES, soup.triangle_count, built);
        mesh_destroy(built);
    }
    pelt_mesh_module.free(&soup);
    return 0;
}
