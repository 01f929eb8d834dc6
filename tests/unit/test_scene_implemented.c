/* What a valid scene asks for and this version does not draw is named, member by member. */
#include "tests/unit/scene_fixture.h"

#define ONE(object)     "{\"objects\": [" object "]}"
#define TORUS(material) "\"shell\": {\"mesh\": {\"shape\": \"torus\"}, \"material\": " material "}"
#define FUR             TORUS("{\"builtin\": \"fur\"}")

static void what_is_not_drawn(void **state) {
    (void)state;
    static const struct {
        const char *scene, *pointer;
    } rows[] = {
        {ONE("{\"skeleton\": {\"builtin\": \"elm\"}}"), "/objects/0/skeleton"},
        {ONE("{" FUR ", \"path\": \"gdm\"}"), "/objects/0/path"},
        {ONE("{" FUR ", \"path\": \"distance\"}"), "/objects/0/path"},
        {ONE("{" FUR ", \"path\": \"frusta\"}"), "/objects/0/path"},
        {ONE("{" FUR ", \"quality\": {\"rank\": 2}}"), "/objects/0/quality/rank"},
        {ONE("{" FUR ", \"quality\": {\"iterations\": 2}}"), "/objects/0/quality/iterations"},
        {ONE("{" FUR ", \"quality\": {\"relief_steps\": 2}}"), "/objects/0/quality/relief_steps"},
        {ONE("{" FUR ", \"quality\": {\"bisections\": 2}}"), "/objects/0/quality/bisections"},
        {ONE("{" FUR "}, {" FUR ", \"path\": \"gdm\"}"), "/objects/1/path"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct read read;
        read_text(&read, rows[i].scene);
        assert_int_equal(read.status, STATUS_OK);
        assert_int_equal(scene_check_implemented(&read.scene, &read.err), STATUS_NOT_IMPLEMENTED);
        assert_int_equal(read.err.fault_count, 1);
        assert_fault(&read.err, rows[i].pointer, "this version does not draw");
        assert_int_equal(scene_check_implemented(&read.scene, NULL), STATUS_NOT_IMPLEMENTED);
        read_finish(&read);
    }
}

static void what_is_drawn(void **state) {
    (void)state;
    static const char *const scenes[] = {
        LEAST(""),
        LEAST(", \"lights\": [{\"shadow\": true}], \"report\": {\"error\": \"none\"}"),
        LEAST(", \"target\": {\"max_error\": 0.1}, \"report\": {\"error\": \"estimate\"}"),
        LEAST(", \"target\": {\"deadline_ms\": 100}, \"report\": {\"error\": \"reference\"}"),
        ONE("{" FUR ", \"path\": \"auto\"}"),
        ONE("{" FUR ", \"path\": \"tetra\", \"quality\": {\"samples\": 9, \"order\": \"sorted\", "
            "\"traversal\": \"fixed\"}}"),
        ONE("{" FUR ", \"quality\": {\"traversal\": \"dda\"}}"),
        ONE("{" FUR ", \"quality\": {\"traversal\": \"adaptive\"}}"),
        ONE("{" FUR
            ", \"path\": \"slicing\", \"quality\": {\"slices\": 2, \"method\": \"hybrid\"}}"),
        ONE("{" FUR ", \"quality\": {\"slices\": 2}}"),
        ONE("{" TORUS("{\"builtin\": \"homogeneous\"}") "}"),
        ONE("{" TORUS("{\"builtin\": \"clouds\"}") "}"),
        ONE("{" TORUS("{\"builtin\": \"fog\"}") "}"),
        ONE("{" TORUS("{\"builtin\": \"weave\"}") "}"),
        ONE("{" TORUS("{\"builtin\": \"chain\"}") "}"),
        ONE("{" TORUS("{\"builtin\": \"rocks\"}") "}"),
        ONE("{" TORUS("{\"builtin\": \"trees\"}") "}"),
        ONE("{" TORUS("{\"builtin\": \"grate\"}") "}"),
        ONE("{" TORUS("{\"builtin\": \"scales\"}") "}"),
        ONE("{" TORUS("{\"builtin\": \"bark\"}") "}"),
        ONE("{" TORUS("{\"height\": \"h.png\"}") "}"),
        ONE("{" TORUS("{\"volume\": \"v.vdb\"}") "}"),
        ONE("{" TORUS("{\"geometry\": {\"shape\": \"torus\"}}") "}"),
        ONE("{\"mesh\": {\"asset\": \"a.glb\"}}"),
    };
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        struct read read;
        read_text(&read, scenes[i]);
        assert_int_equal(read.status, STATUS_OK);
        assert_int_equal(scene_check_implemented(&read.scene, &read.err), STATUS_OK);
        assert_int_equal(read.err.fault_count, 0);
        read_finish(&read);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_not_drawn),
        cmocka_unit_test(what_is_drawn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
