#include <stdio.h>

int main(void) {
    puts("pelt " PELT_VERSION);
    return 0;
}
