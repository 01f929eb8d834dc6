/* The pictures on a sweep's page. They are encoded into it, reduced where they are large: the page
 * shall stay one that can be mailed. */
#include <stdlib.h>

#include "service/encode.h"
#include "service/sweep_page.h"
#include "service/sweep_picture.h"

enum {
    SIDE_MAX = 320, /* of an embedded picture, in pixels */
    FEW = 200       /* with less than that, its pixels are shown as squares */
};

static bool embed(FILE *out, const struct sweep *sweep, const struct sweep_point *point,
                  enum sweep_view view, const char *text) {
    int width, height;
    unsigned char *png = NULL;
    size_t bytes = 0;
    char *code = NULL;
    float *pixels = sweep_picture(sweep, point, view, SIDE_MAX, &width, &height);
    if (pixels && encode_png(pixels, width, height, &png, &bytes, NULL) == STATUS_OK)
        code = encode_base64(png, bytes, NULL);
    if (code)
        fprintf(out,
                "<img%s width=\"%d\" height=\"%d\" alt=\"%s\" src=\"data:image/png;base64,%s\">\n",
                width < FEW ? " class=\"few\"" : "", width, height, text, code);
    bool good = code != NULL;
    free(code);
    free(png);
    free(pixels);
    return good;
}

/* A bar of colours with labels below: the linear part of a scale from 0 to 1. */
static void scale(FILE *out, const char *id, const char *name, const char *const *labels,
                  int count) {
    fprintf(out,
            "<svg class=\"scale\" viewBox=\"0 0 280 58\" role=\"img\" aria-label=\"%s\">"
            "<defs><linearGradient id=\"%s\">",
            name, id);
    for (int i = 0; i <= 16; i++) {
        double srgb[3];
        sweep_colour(i / 16.0, srgb);
        fprintf(out, "<stop offset=\"%.4f\" stop-color=\"rgb(%.0f,%.0f,%.0f)\"/>", i / 16.0,
                srgb[0], srgb[1], srgb[2]);
    }
    fprintf(out,
            "</linearGradient></defs><text x=\"2\" y=\"14\">%s</text><rect x=\"2\" y=\"20\" "
            "width=\"272\" height=\"16\" fill=\"url(#%s)\" stroke=\"#111\"/>",
            name, id);
    for (int i = 0; i < count; i++)
        fprintf(out, "<text x=\"%d\" y=\"54\" text-anchor=\"%s\">%s</text>",
                2 + 272 * i / (count - 1),
                i == 0          ? "start"
                : i + 1 < count ? "middle"
                                : "end",
                labels[i]);
    fputs("</svg>\n", out);
}

static bool gallery_point(FILE *out, const struct sweep *sweep, const struct sweep_series *series,
                          const struct sweep_point *point) {
    char text[128];
    fprintf(out, "<figure><div class=\"%s\">\n", sweep->pixels ? "one" : "views");
    snprintf(text, sizeof text, "%s %d", series->row->name, point->quality);
    bool good = embed(out, sweep, point, SWEEP_VIEW_PICTURE, text);
    if (!sweep->pixels) {
        snprintf(text, sizeof text, "difference of %s %d", series->row->name, point->quality);
        good = good && embed(out, sweep, point, SWEEP_VIEW_DIFFERENCE, text);
        snprintf(text, sizeof text, "FLIP of %s %d", series->row->name, point->quality);
        good = good && embed(out, sweep, point, SWEEP_VIEW_FLIP, text);
    }
    fprintf(out, "</div><figcaption><b>%s, %s %d</b>: <span>RMSE ", series->row->name,
            series->row->quality, point->quality);
    sweep_figure(out, point->error.touched.rmse);
    if (!sweep->pixels) {
        fputs("</span>, <span>FLIP ", out);
        sweep_figure(out, point->error.flip);
    }
    fputs("</span>, <span>", out);
    sweep_time(out, point->total_ms.median);
    fputs(" ms</span></figcaption></figure>\n", out);
    return good;
}

bool sweep_gallery(FILE *out, const struct sweep *sweep) {
    static const char *const decades[] = {"≤10⁻⁴", "10⁻³", "10⁻²", "0.1", "≥1"};
    static const char *const shares[] = {"0", "0.25", "0.5", "0.75", "1"};
    _Static_assert(sizeof decades / sizeof *decades == SWEEP_DECADES + 1, "a label each decade");
    int longest = sweep->width > sweep->height ? sweep->width : sweep->height;
    int factor = (longest + SIDE_MAX - 1) / SIDE_MAX;
    bool good = true;
    if (factor > 1)
        fprintf(out,
                "<p>Shown at 1/%d of their size: means of %d &times; %d pixels, of errors "
                "too.</p>\n",
                factor, factor, factor);
    if (!sweep->pixels) {
        fputs("<figure class=\"one\">", out);
        good = embed(out, sweep, NULL, SWEEP_VIEW_PICTURE, "the reference");
        fputs("<figcaption><b>Reference</b></figcaption></figure>\n"
              "<p>Of each point: the picture, its difference from the reference, its FLIP. "
              "Pictures lie over mid-grey where they are transparent.</p>\n<div class=\"scales\">",
              out);
        scale(out, "scale-difference", "difference: RMS of a pixel&#39;s RGBA", decades,
              SWEEP_DECADES + 1);
        scale(out, "scale-flip", "FLIP", shares, 5);
        fputs("</div>\n", out);
    }
    for (size_t s = 0; s < sweep->series_count && good; s++) {
        const struct sweep_series *series = &sweep->series[s];
        if (*series->refused)
            continue;
        fprintf(out, "<h3>%s</h3>\n<div class=\"gallery%s\">\n", series->row->name,
                sweep->pixels ? " few-views" : "");
        for (size_t i = 0; i < series->point_count && good; i++)
            if (series->points[i].pixels)
                good = gallery_point(out, sweep, series, &series->points[i]);
        fputs("</div>\n", out);
    }
    return good;
}
