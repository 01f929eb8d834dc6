// OpenImageIO behind the C table of image_oiio.h, built as a module of its own and opened only when
// a scene reads an image or asks for OpenEXR (261 shared libraries come with it).
//
// The input is untrusted, and OpenImageIO 2.4 has open CVEs in its rarer readers. So the format is
// decided from magic bytes and exactly that reader is made (no other one is tried), it reads from
// memory, and the dimensions are checked before any pixel is decoded (image_oiio_guard.h). Pixels
// are asked for in stripes into zero pages, so a file that claims more than it holds fails at the
// stripe where it ends, before its memory is touched. Volumes are in image_oiio_volume.h.
//
// Left out: subimages of flat images, mip levels, deep pixels, more than four channels, colour
// management (the caller knows what its numbers mean).
#include "renderer/asset/image_oiio.h"

#include "renderer/asset/image_oiio_guard.h"
#include "renderer/asset/image_oiio_volume.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>

// The frames are written one behind another; the file closes with the last.
struct image_gif {
    OIIO::Filesystem::IOVecOutput memory;
    std::unique_ptr<OIIO::ImageOutput> output;
    OIIO::ImageSpec spec;
    bool begun = false;
};

namespace {

using namespace pelt;
using OIIO::ImageOutput;

int decode_checked(const unsigned char *data, size_t bytes, image_pixels *image, char *message,
                   size_t message_bytes) {
    Opened opened;
    int result = open_image(data, bytes, opened, message, message_bytes);
    if (result != 0)
        return result;
    const ImageSpec &spec = opened.spec;
    std::string name = opened.format->name;
    int channels = spec.nchannels < channels_max ? spec.nchannels : channels_max;
    Floats pixels = make_floats((size_t)spec.width * (size_t)spec.height * (size_t)channels);
    if (!pixels)
        return no_memory(message, message_bytes, "the " + name + " image");
    if (!read_stripes(*opened.input, 0, spec, channels, pixels.get()))
        return refuse(message, message_bytes,
                      name + " image that is cut short or damaged: " + reason(*opened.input));
    image->width = spec.width;
    image->height = spec.height;
    image->channels = channels;
    image->data = pixels.release();
    image->bits = bits_of(spec);
    image->is_float = spec.format.is_floating_point();
    return 0;
}

int encode_checked(const float *rgba, int width, int height, unsigned char **data, size_t *bytes,
                   char *message, size_t message_bytes) {
    configure();
    std::unique_ptr<ImageOutput> output = ImageOutput::create("openexr");
    if (!output || !output->supports("ioproxy")) {
        OIIO::geterror();
        return refuse(message, message_bytes, "this OpenImageIO cannot write OpenEXR to memory");
    }
    OIIO::Filesystem::IOVecOutput memory;
    output->set_ioproxy(&memory);
    ImageSpec spec(width, height, 4, TypeDesc::FLOAT);
    spec.channelnames = {"R", "G", "B", "A"};
    spec.alpha_channel = 3;
    spec.attribute("compression", "zip");
    spec.attribute("oiio:ColorSpace", "Linear");
    // The writer would put the time of day here: the same pixels must give the same bytes.
    spec.attribute("DateTime", "1970:01:01 00:00:00");
    if (!output->open("image.exr", spec) || !output->write_image(TypeDesc::FLOAT, rgba) ||
        !output->close())
        return refuse(message, message_bytes, "OpenEXR: " + output->geterror());
    const std::vector<unsigned char> &buffer = memory.buffer();
    unsigned char *copy = static_cast<unsigned char *>(std::malloc(buffer.size()));
    if (!copy)
        return no_memory(message, message_bytes, "the OpenEXR file");
    std::memcpy(copy, buffer.data(), buffer.size());
    *data = copy;
    *bytes = buffer.size();
    return 0;
}

// OpenImageIO writes GIF by gif.h, which takes what a frame has in common with the one before as
// transparent, so a picture's own transparency cannot be kept.
int gif_open(int width, int height, int centiseconds, image_gif **made, char *message,
             size_t message_bytes) {
    configure();
    std::unique_ptr<image_gif> gif(new image_gif);
    gif->output = ImageOutput::create("gif");
    if (!gif->output || !gif->output->supports("ioproxy") || !gif->output->supports("multiimage")) {
        OIIO::geterror();
        return refuse(message, message_bytes,
                      "this OpenImageIO cannot write animated GIF to memory");
    }
    gif->output->set_ioproxy(&gif->memory);
    gif->spec = ImageSpec(width, height, 3, TypeDesc::UINT8);
    const int rate[2] = {100, centiseconds};
    gif->spec.attribute("FramesPerSecond",
                        TypeDesc(TypeDesc::INT, TypeDesc::VEC2, TypeDesc::RATIONAL), rate);
    *made = gif.release();
    return 0;
}

int gif_write(image_gif *gif, const unsigned char *rgb, char *message, size_t message_bytes) {
    bool opened = gif->begun
                      ? gif->output->open("sequence.gif", gif->spec, ImageOutput::AppendSubimage)
                      : gif->output->open("sequence.gif", gif->spec);
    gif->begun = true;
    if (!opened || !gif->output->write_image(TypeDesc::UINT8, rgb))
        return refuse(message, message_bytes, "GIF: " + gif->output->geterror());
    return 0;
}

int gif_close(image_gif *gif, unsigned char **data, size_t *bytes, char *message,
              size_t message_bytes) {
    bool closed = !gif->begun || gif->output->close();
    if (!data)
        return 0;
    if (!closed || gif->memory.buffer().empty())
        return refuse(message, message_bytes, "GIF: " + gif->output->geterror());
    const std::vector<unsigned char> &buffer = gif->memory.buffer();
    unsigned char *copy = static_cast<unsigned char *>(std::malloc(buffer.size()));
    if (!copy)
        return no_memory(message, message_bytes, "the GIF file");
    std::memcpy(copy, buffer.data(), buffer.size());
    *data = copy;
    *bytes = buffer.size();
    return 0;
}

// Nothing thrown by the library passes into C.
template <typename Call> int guarded(Call call, char *message, size_t message_bytes) {
    try {
        return call();
    } catch (const std::bad_alloc &) {
        // Not through no_memory(): a std::string would need some.
        if (message_bytes)
            std::snprintf(message, message_bytes, "no memory for the image");
        return IMAGE_OUT_OF_MEMORY;
    } catch (const std::exception &e) {
        return refuse(message, message_bytes, std::string("the image library failed: ") + e.what());
    } catch (...) {
        return refuse(message, message_bytes, "the image library failed");
    }
}

int decode(const unsigned char *data, size_t bytes, image_pixels *image, char *message,
           size_t message_bytes) {
    *image = image_pixels();
    return guarded([&] { return decode_checked(data, bytes, image, message, message_bytes); },
                   message, message_bytes);
}

int decode_volume(const unsigned char *data, size_t bytes, volume_pixels *volume, char *message,
                  size_t message_bytes) {
    *volume = volume_pixels();
    return guarded([&] { return volume_checked(data, bytes, volume, message, message_bytes); },
                   message, message_bytes);
}

int encode_exr(const float *rgba, int width, int height, unsigned char **data, size_t *bytes,
               char *message, size_t message_bytes) {
    *data = nullptr;
    *bytes = 0;
    return guarded(
        [&] { return encode_checked(rgba, width, height, data, bytes, message, message_bytes); },
        message, message_bytes);
}

int gif_begin(int width, int height, int centiseconds, image_gif **gif, char *message,
              size_t message_bytes) {
    *gif = nullptr;
    return guarded(
        [&] { return gif_open(width, height, centiseconds, gif, message, message_bytes); }, message,
        message_bytes);
}

int gif_add(image_gif *gif, const unsigned char *rgb, char *message, size_t message_bytes) {
    return guarded([&] { return gif_write(gif, rgb, message, message_bytes); }, message,
                   message_bytes);
}

int gif_end(image_gif *gif, unsigned char **data, size_t *bytes, char *message,
            size_t message_bytes) {
    if (data)
        *data = nullptr;
    int result = guarded([&] { return gif_close(gif, data, bytes, message, message_bytes); },
                         message, message_bytes);
    try {
        delete gif;
    } catch (...) {
    }
    return result;
}

// Of the library that is loaded, which need not be the one that was compiled against.
const char *version() {
    try {
        return OIIO::ustring(OIIO::get_string_attribute("version", OIIO_VERSION_STRING)).c_str();
    } catch (...) {
        return OIIO_VERSION_STRING;
    }
}

} // namespace

extern "C" __attribute__((visibility("default"))) const image_module pelt_image_module = {
    decode, decode_volume, encode_exr, gif_begin, gif_add, gif_end, version};
