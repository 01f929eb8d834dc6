// What must hold before OpenImageIO may see a file: the format by magic bytes, the dimensions by
// the raw header for the formats whose reader allocates on opening, by the reader's own header for
// all.
#ifndef PELT_RENDERER_ASSET_IMAGE_OIIO_GUARD_H
#define PELT_RENDERER_ASSET_IMAGE_OIIO_GUARD_H

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>

#include "renderer/asset/image_oiio.h"

namespace pelt {

using OIIO::ImageInput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

constexpr int channels_max = 4;
constexpr uint64_t exr_tile_max = 2048;
constexpr int stripe_pixels = 1 << 20; // 1 M pixels a stripe: 16 MB of RGBA floats

inline int refuse(char *message, size_t bytes, const std::string &text) {
    if (bytes)
        std::snprintf(message, bytes, "%s", text.c_str());
    return IMAGE_REFUSED;
}

inline int no_memory(char *message, size_t bytes, const std::string &what) {
    refuse(message, bytes, "no memory for " + what);
    return IMAGE_OUT_OF_MEMORY;
}

// The first line of what the library says; the others advise whoever runs it.
inline std::string reason(ImageInput &input) {
    std::string text = input.geterror();
    return text.substr(0, text.find('\n'));
}

struct Format {
    const char *reader; // OpenImageIO's name
    const char *name;   // for people
    const char *magic;
    size_t magic_bytes, at;
};

// RIFF....WEBP is told by its second half: "RIFF" alone is also WAV and AVI.
const Format formats[] = {
    {"png", "PNG", "\x89PNG\r\n\x1a\n", 8, 0},
    {"jpeg", "JPEG", "\xff\xd8\xff", 3, 0},
    {"openexr", "OpenEXR", "v/1\x01", 4, 0},
    {"tiff", "TIFF", "II*\0", 4, 0},
    {"tiff", "TIFF", "MM\0*", 4, 0},
    {"hdr", "Radiance HDR", "#?RADIANCE", 10, 0},
    {"hdr", "Radiance HDR", "#?RGBE", 6, 0},
    {"webp", "WebP", "WEBP", 4, 8},
    {"gif", "GIF", "GIF87a", 6, 0},
    {"gif", "GIF", "GIF89a", 6, 0},
};

inline const Format *find_format(const unsigned char *data, size_t bytes) {
    for (const Format &f : formats)
        if (bytes >= f.at + f.magic_bytes && std::memcmp(data + f.at, f.magic, f.magic_bytes) == 0)
            return &f;
    return nullptr;
}

inline std::string dimension_fault(const char *name, uint64_t width, uint64_t height) {
    std::string size = std::to_string(width) + " x " + std::to_string(height) + " pixels";
    if (width == 0 || height == 0)
        return std::string(name) + " image of " + size + ": it is empty";
    if (width > IMAGE_SIDE_MAX || height > IMAGE_SIDE_MAX || width * height > IMAGE_PIXELS_MAX)
        return std::string(name) + " image of " + size + "; the limits are " +
               std::to_string(IMAGE_SIDE_MAX) + " a side and " + std::to_string(IMAGE_PIXELS_MAX) +
               " in all";
    return "";
}

inline uint64_t little(const unsigned char *p, int bytes) {
    uint64_t value = 0;
    for (int i = bytes - 1; i >= 0; i--)
        value = value << 8 | p[i];
    return value;
}

inline uint64_t big(const unsigned char *p, int bytes) {
    uint64_t value = 0;
    for (int i = 0; i < bytes; i++)
        value = value << 8 | p[i];
    return value;
}

// Whether the chunks of a PNG file end within it, with IEND. OpenImageIO's read callback jumps out
// of a C++ function where the file ends early, and leaks a string each time.
inline bool png_is_whole(const unsigned char *data, size_t bytes) {
    size_t at = 8;
    while (bytes - at >= 12) {
        uint64_t length = big(data + at, 4);
        if (length > bytes - at - 12)
            return false;
        if (std::memcmp(data + at + 4, "IEND", 4) == 0)
            return true;
        at += 12 + (size_t)length;
    }
    return false;
}

inline int32_t exr_int(const unsigned char *p) {
    return (int32_t)little(p, 4);
}

// One attribute of an OpenEXR header, if it decides how much memory the reader takes on opening.
inline std::string exr_attribute_fault(const std::string &name, const unsigned char *value,
                                       size_t bytes) {
    if (name == "dataWindow" || name == "displayWindow") {
        if (bytes != 16)
            return "OpenEXR image with a damaged " + name;
        int64_t width = (int64_t)exr_int(value + 8) - exr_int(value) + 1;
        int64_t height = (int64_t)exr_int(value + 12) - exr_int(value + 4) + 1;
        return dimension_fault("OpenEXR", width < 0 ? 0 : (uint64_t)width,
                               height < 0 ? 0 : (uint64_t)height);
    }
    if (name == "tiles") {
        uint64_t width = bytes == 9 ? little(value, 4) : 0,
                 height = width ? little(value + 4, 4) : 0;
        if (width < 16 || height < 16 || width > exr_tile_max || height > exr_tile_max)
            return "OpenEXR image in tiles of " + std::to_string(width) + " x " +
                   std::to_string(height) + " pixels; from 16 to " + std::to_string(exr_tile_max) +
                   " a side can be read";
    }
    if (name == "type") {
        std::string type(reinterpret_cast<const char *>(value), bytes);
        if (type != "scanlineimage" && type != "tiledimage")
            return "OpenEXR image of another type than scan lines or tiles";
    }
    return "";
}

// OpenEXR makes its table of lines or tiles when it opens a file, from the header alone: 50 bytes
// can ask for gigabytes. So the header is walked first: magic, version with flags, then name, type,
// size and value of each attribute, and an empty name.
inline std::string exr_fault(const unsigned char *data, size_t bytes) {
    const std::string damaged = "OpenEXR image whose header is cut short or damaged";
    constexpr uint64_t deep = 0x800, multipart = 0x1000;
    if (bytes < 8)
        return damaged;
    if (little(data + 4, 4) & (deep | multipart))
        return "OpenEXR image of several parts or with depth: only one flat part can be read";
    size_t at = 8;
    while (at < bytes && data[at]) {
        std::string words[2]; // name, type
        for (std::string &word : words) {
            const void *end = std::memchr(data + at, 0, bytes - at);
            if (!end)
                return damaged;
            word = reinterpret_cast<const char *>(data + at);
            at += word.size() + 1;
        }
        if (bytes - at < 4)
            return damaged;
        uint64_t size = little(data + at, 4);
        if (size > bytes - at - 4)
            return damaged;
        at += 4;
        std::string fault = exr_attribute_fault(words[0], data + at, (size_t)size);
        if (!fault.empty())
            return fault;
        at += (size_t)size;
    }
    return at < bytes ? "" : damaged;
}

// What the raw header says, where it can be read without a decoder; "" if nothing speaks against
// it.
inline std::string header_fault(const Format &format, const unsigned char *data, size_t bytes) {
    std::string reader = format.reader;
    if (reader == "png") {
        if (bytes < 33 || std::memcmp(data + 12, "IHDR", 4) != 0)
            return "PNG image without its header";
        uint64_t width = big(data + 16, 4), height = big(data + 20, 4);
        std::string fault = dimension_fault("PNG", width, height);
        // Deflate packs at most 1032 to 1, and a row has at least one bit a pixel.
        if (fault.empty() && width * height / 8 > (uint64_t)bytes * 1032)
            fault = "PNG image of " + std::to_string(width) + " x " + std::to_string(height) +
                    " pixels in " + std::to_string(bytes) +
                    " bytes: it is cut short, or its "
                    "header lies";
        if (fault.empty() && !png_is_whole(data, bytes))
            fault = "PNG image that is cut short or damaged";
        return fault;
    }
    if (reader == "openexr")
        return exr_fault(data, bytes);
    if (reader == "gif") {
        if (bytes < 10)
            return "GIF image without its header";
        return dimension_fault("GIF", little(data + 6, 2), little(data + 8, 2));
    }
    if (reader == "webp") {
        if (bytes < 30)
            return "WebP image without its header";
        if (std::memcmp(data + 12, "VP8X", 4) == 0)
            return dimension_fault("WebP", little(data + 24, 3) + 1, little(data + 27, 3) + 1);
        if (std::memcmp(data + 12, "VP8L", 4) == 0) {
            uint64_t size = little(data + 21, 4); // two fields of 14 bits, each less one
            return dimension_fault("WebP", (size & 0x3fff) + 1, (size >> 14 & 0x3fff) + 1);
        }
        return dimension_fault("WebP", little(data + 26, 2) & 0x3fff,
                               little(data + 28, 2) & 0x3fff);
    }
    return "";
}

// Floats in zero pages, malloc'ed so that C may free them.
using Floats = std::unique_ptr<float, decltype(&std::free)>;

inline Floats make_floats(size_t count) {
    return Floats(static_cast<float *>(std::calloc(count, sizeof(float))), std::free);
}

inline void configure() {
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1); // none besides this one
    OIIO::attribute("try_all_readers", 0);
    OIIO::attribute("limits:channels", 64);
    OIIO::attribute("limits:imagesize_MB", 1024);
}

// A flat image that is open; the bytes must outlive it.
struct Opened {
    const Format *format = nullptr;
    std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;
    std::unique_ptr<ImageInput> input; // first to go
    ImageSpec spec;
};

// What speaks against the subimage that the input is at; "" if nothing does.
inline std::string spec_fault(const std::string &name, const ImageSpec &spec) {
    std::string fault = dimension_fault(name.c_str(), spec.width < 0 ? 0 : (uint64_t)spec.width,
                                        spec.height < 0 ? 0 : (uint64_t)spec.height);
    if (fault.empty() && (spec.depth > 1 || spec.deep))
        fault = name + " image with depth: only flat images can be read";
    if (fault.empty() && spec.nchannels < 1)
        fault = name + " image without channels";
    if (fault.empty() && spec.tile_width && // TIFF: OpenEXR's were checked in exr_fault()
        ((uint64_t)spec.tile_width > IMAGE_SIDE_MAX || (uint64_t)spec.tile_height > IMAGE_SIDE_MAX))
        fault = name + " image in tiles of " + std::to_string(spec.tile_width) + " x " +
                std::to_string(spec.tile_height) + " pixels";
    return fault;
}

// 0, or what refuse() gives.
inline int open_image(const unsigned char *data, size_t bytes, Opened &opened, char *message,
                      size_t message_bytes) {
    const Format *format = opened.format = find_format(data, bytes);
    if (!format)
        return refuse(message, message_bytes,
                      bytes ? "not an image that can be read here: PNG, JPEG, OpenEXR, TIFF, "
                              "Radiance HDR, WebP and GIF can"
                            : "the image is empty");
    std::string fault = header_fault(*format, data, bytes);
    if (!fault.empty())
        return refuse(message, message_bytes, fault);

    configure();
    std::string name = format->name;
    opened.memory = std::make_unique<OIIO::Filesystem::IOMemReader>(data, bytes);
    opened.input = ImageInput::create(format->reader);
    ImageInput *input = opened.input.get();
    if (!input || !input->supports("ioproxy")) {
        OIIO::geterror(); // drop it: it speaks of plugins
        return refuse(message, message_bytes,
                      "this OpenImageIO cannot read " + name + " from memory");
    }
    input->set_ioproxy(opened.memory.get());
    ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1);
    if (!input->open(std::string("asset.") + format->reader, opened.spec, hints))
        return refuse(message, message_bytes,
                      name + " image that cannot be opened: " + reason(*input));
    fault = spec_fault(name, opened.spec);
    return fault.empty() ? 0 : refuse(message, message_bytes, fault);
}

// Pixels of the subimage, in stripes; false where the file ends or is damaged. Some readers go on
// after an error and give what they have; here half an image is none.
inline bool read_stripes(ImageInput &input, int subimage, const ImageSpec &spec, int channels,
                         float *data) {
    size_t row = (size_t)spec.width * (size_t)channels;
    if (spec.tile_width)
        return input.read_image(subimage, 0, 0, channels, TypeDesc::FLOAT, data) &&
               !input.has_error();
    int rows = stripe_pixels / spec.width > 0 ? stripe_pixels / spec.width : 1;
    for (int y = 0; y < spec.height; y += rows) {
        int end = y + rows < spec.height ? y + rows : spec.height;
        if (!input.read_scanlines(subimage, 0, spec.y + y, spec.y + end, 0, 0, channels,
                                  TypeDesc::FLOAT, data + row * (size_t)y))
            return false;
    }
    return !input.has_error();
}

// Of the file's own samples, at most 32.
inline int bits_of(const ImageSpec &spec) {
    int bits = (int)spec.format.basesize() * 8;
    return bits > 32 ? 32 : bits;
}

} // namespace pelt

#endif
