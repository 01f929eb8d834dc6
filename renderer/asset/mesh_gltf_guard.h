// What must hold before tinygltf may see a file, and how a file is refused.
//
// tinygltf 2.7.0 reads up to 8 bytes past the end of a .glb whose second chunk claims them (its
// check leaves out the chunk's own header), recurses into `extras` and `extensions` as deep as the
// file nests, and copies the binary chunk once for every entry of `buffers`. So the container is
// checked here, and the JSON text is scanned once, without building anything, for depth and for
// numbers.
#ifndef PELT_RENDERER_ASSET_MESH_GLTF_GUARD_H
#define PELT_RENDERER_ASSET_MESH_GLTF_GUARD_H

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>

#include "renderer/asset/mesh_gltf.h"

namespace pelt {

struct refusal : std::runtime_error {
    gltf_outcome outcome;
    refusal(gltf_outcome why, const std::string &text) : std::runtime_error(text), outcome(why) {}
};

[[noreturn]] __attribute__((format(printf, 2, 3))) inline void refuse_as(gltf_outcome outcome,
                                                                         const char *format, ...) {
    char text[400];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    throw refusal(outcome, text);
}

#define REFUSE(...) ::pelt::refuse_as(GLTF_BAD, __VA_ARGS__)

constexpr std::size_t FILE_BYTES_MAX = std::size_t(1) << 30;
constexpr std::size_t DEPTH_MAX = 64; // glTF itself nests less than 10 deep
constexpr std::size_t VALUES_MAX = 2000000;
constexpr std::size_t VALUE_BYTES = 600; // what the costliest value, a node, takes in tinygltf
constexpr std::size_t BUFFER_COPIES_MAX = FILE_BYTES_MAX;

struct container {
    bool binary;
    const unsigned char *json;
    std::size_t json_bytes;
    std::size_t chunk_bytes; // of the binary chunk
};

inline std::uint32_t little_endian(const unsigned char *p) {
    return std::uint32_t(p[0]) | std::uint32_t(p[1]) << 8 | std::uint32_t(p[2]) << 16 |
           std::uint32_t(p[3]) << 24;
}

// The container's parts, each within the file.
inline container open_container(const unsigned char *data, std::size_t bytes) {
    if (bytes > FILE_BYTES_MAX)
        REFUSE("the file has %zu bytes; at most %zu are read", bytes, FILE_BYTES_MAX);
    if (bytes < 4)
        REFUSE("the file has only %zu bytes: it is not glTF", bytes);
    if (std::memcmp(data, "glTF", 4) != 0) {
        std::size_t at = 0;
        if (bytes >= 3 && std::memcmp(data, "\xef\xbb\xbf", 3) == 0)
            at = 3;
        while (at < bytes && std::strchr(" \t\r\n", data[at]) && data[at])
            at++;
        if (at == bytes || data[at] != '{')
            REFUSE("the file is neither .glb (it does not begin with \"glTF\") nor .gltf (JSON)");
        return {false, data, bytes, 0};
    }
    if (bytes < 20)
        REFUSE("the .glb is cut short: %zu bytes, less than its header", bytes);
    std::uint32_t version = little_endian(data + 4), length = little_endian(data + 8);
    std::uint64_t json_bytes = little_endian(data + 12);
    if (version != 2)
        REFUSE("the .glb is of version %u; version 2 is read", version);
    if (length > bytes)
        REFUSE("the .glb is cut short: its header says %u bytes, %zu are there", length, bytes);
    if (little_endian(data + 16) != 0x4e4f534a)
        REFUSE("the .glb does not begin with a JSON chunk");
    if (20 + json_bytes > length)
        REFUSE("the .glb's JSON chunk reaches past its end: %llu bytes in a file of %u",
               (unsigned long long)json_bytes, length);
    std::uint64_t at = 20 + json_bytes, chunk_bytes = 0;
    if (at < length) {
        if (at + 8 > length)
            REFUSE("the .glb ends within the header of its second chunk");
        chunk_bytes = little_endian(data + at);
        if (at + 8 + chunk_bytes > length)
            REFUSE("the .glb's binary chunk reaches past its end: %llu bytes from byte %llu in a "
                   "file of %u",
                   (unsigned long long)chunk_bytes, (unsigned long long)at + 8, length);
    }
    return {true, data + 20, std::size_t(json_bytes), std::size_t(chunk_bytes)};
}

// Refuses text that nests too deep, holds too many values, or asks for too many copies of the
// binary chunk. Not a parser: whatever is wrong otherwise, tinygltf says. Returns how many values
// there are, rather too many than too few.
inline std::size_t check_json(const container &file) {
    const char *text = reinterpret_cast<const char *>(file.json);
    std::size_t depth = 0, values = 0, buffers = 0, string_at = 0;
    bool in_string = false, escaped = false, may_be_buffers = false, string_escaped = false;
    for (std::size_t i = 0; i < file.json_bytes; i++) {
        char c = text[i];
        if (in_string) {
            if (escaped) {
                escaped = false;
            } else if (c == '\\') {
                escaped = string_escaped = true;
            } else if (c == '"') {
                in_string = false;
                // A member's name at the top decides what the elements below it count as. A name
                // with an escape might spell "buffers" too.
                if (depth == 1)
                    may_be_buffers =
                        string_escaped || std::string(text + string_at, i - string_at) == "buffers";
            }
            continue;
        }
        if (c == '"') {
            in_string = true;
            string_escaped = false;
            string_at = i + 1;
        } else if (c == '{' || c == '[') {
            buffers += c == '{' && depth == 2 && may_be_buffers;
            values++;
            if (++depth > DEPTH_MAX)
                REFUSE("the JSON nests deeper than %zu", DEPTH_MAX);
        } else if (c == '}' || c == ']') {
            depth -= depth > 0;
        } else if (c == ',') {
            values++;
        }
    }
    if (values > VALUES_MAX)
        refuse_as(GLTF_TOO_COMPLEX, "the JSON holds more than %zu values", VALUES_MAX);
    if (buffers > 0 && file.chunk_bytes > BUFFER_COPIES_MAX / buffers)
        refuse_as(GLTF_TOO_COMPLEX, "%zu buffers share a binary chunk of %zu bytes", buffers,
                  file.chunk_bytes);
    return values;
}

} // namespace pelt

#endif
