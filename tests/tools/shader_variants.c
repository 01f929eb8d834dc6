/* Writes variants of every program to a folder, one file a stage, for compilers that run without a
 * GL (tests/check/shaders.sh): those of variant_cover.h, or all. Usage: shader_variants FOLDER
 * [all]
 *
 * Files are named PROGRAM.VARIANT.STAGE, e.g. TETRA.0x0009.frag, so that all stages of a program
 * share what precedes the last dot. Each opens with a list of the files it is made of; #line
 * directives refer to them by number. Prints PROGRAM.VARIANT, one a line. */
#include <stdio.h>
#include <string.h>

#include "renderer/gl/program.h"
#include "renderer/gl/source.h"
#include "tests/tools/variant_cover.h"

static int write_stage(const char *folder, enum gl_program_id id, uint32_t variant,
                       const char *stage) {
    const char *file = gl_program_file(id, stage);
    if (!file)
        return 0;
    struct gl_source source;
    struct error err = {0};
    char path[4096];
    int failed = 1;
    FILE *out = NULL;
    if (gl_source_assemble(&source, file, variant, &err) != STATUS_OK) {
        fprintf(stderr, "%s\n", err.fault_count ? err.faults[0].message : "no text");
        goto done;
    }
    int length = snprintf(path, sizeof path, "%s/%s.0x%04x.%s", folder, gl_program_name(id),
                          (unsigned)variant, stage);
    if (length < 0 || (size_t)length >= sizeof path || !(out = fopen(path, "w"))) {
        perror(folder);
        goto done;
    }
    for (size_t i = 0; i < source.file_count; i++)
        fprintf(out, "// file %zu: shaders/%s\n", i, source.files[i]);
    fwrite(source.text, 1, source.length, out);
    failed = ferror(out);
    if (fclose(out) != 0 || failed) {
        perror(path);
        failed = 1;
    }
done:
    gl_source_finish(&source);
    error_clear(&err);
    return failed;
}

int main(int argc, char **argv) {
    static const char *const stages[] = {"vert", "frag", "comp"};
    bool all = argc == 3 && strcmp(argv[2], "all") == 0;
    int together = argc == 3 && strcmp(argv[2], "3") == 0 ? 3 : 2;
    if (argc != 2 && !all && together != 3) {
        fputs("usage: shader_variants FOLDER [3|all]\n", stderr);
        return 2;
    }
    int failed = 0;
    for (int id = 0; id < GL_PROGRAM_COUNT; id++) {
        uint32_t known = gl_program_flags((enum gl_program_id)id), variant = 0;
        static struct variant_cover cover;
        variant_cover_init(&cover, (enum gl_program_id)id, together);
        /* (variant - known) & known counts through the submasks of `known`, and ends at 0 again. */
        do {
            if (gl_program_makes_sense((enum gl_program_id)id, variant) &&
                (variant_cover_takes(&cover, variant) || all)) {
                for (size_t i = 0; i < sizeof stages / sizeof *stages; i++)
                    failed |= write_stage(argv[1], (enum gl_program_id)id, variant, stages[i]);
                printf("%s.0x%04x\n", gl_program_name((enum gl_program_id)id), (unsigned)variant);
            }
            variant = (variant - known) & known;
        } while (variant);
    }
    return failed;
}
