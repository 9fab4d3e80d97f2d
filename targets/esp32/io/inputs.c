/* SPDX-License-Identifier: MIT */
#include "io/inputs.h"

#include "io/switch_timer.h"
#include "machine/machine.h"
#include "pin_config.h"
#include "step_pins.h"

#include "driver/gpio.h"
#include "esp_attr.h"
#include "esp_intr_alloc.h"
#include "esp_timer.h"
#include "freertos/FreeRTOS.h"
#include "soc/gpio_struct.h"

/* A switch that stops the machine counts at its first edge, whatever noise follows; off is believed after 5
 * ms. The probe's level is only looked at between moves: the step interrupt reads the pin itself. */
static const struct debounce_time stop_time = {.on_us = 0, .off_us = 5000};
static const struct debounce_time probe_time = {.on_us = 2000, .off_us = 2000};
static const struct debounce_time button_time = {.on_us = 10000, .off_us = 20000};

static portMUX_TYPE lock = portMUX_INITIALIZER_UNLOCKED;

/* Inputs that are on, as the pins are now. */
static uint32_t IRAM_ATTR read_pins(const struct inputs *inputs) {
    const uint32_t bank[PIN_BANKS] = {GPIO.in, GPIO.in1.val};
    uint32_t high = 0, wired = 0;
    for (unsigned input = 0; input < INPUT_COUNT; input++) {
        uint8_t pin = inputs->wire[input].pin;
        if (pin == NO_PIN)
            continue;
        wired |= 1u << input;
        high |= (bank[pin / PIN_BANK_WIDTH] >> pin % PIN_BANK_WIDTH & 1u) << input;
    }
    return (high ^ inputs->active_low) & wired;
}

/* On core 1, with its interrupts off: as an interrupt or in a critical section.
 * @return inputs that have changed, by their pins or for good */
static uint32_t IRAM_ATTR take_levels(struct inputs *inputs) {
    uint32_t now_us = (uint32_t)esp_timer_get_time();
    uint32_t before = inputs->debounce.raw;
    uint32_t changed = debounce_sample(&inputs->debounce, read_pins(inputs), now_us);
    return changed | (before ^ inputs->debounce.raw);
}

static void IRAM_ATTR take_sample(struct inputs *inputs) {
    if ((take_levels(inputs) & INPUT_STOPPING) != 0 && inputs->machine != NULL)
        machine_edge_isr(inputs->machine);
}

static void IRAM_ATTR on_switch_timer(void *arg) {
    struct inputs *inputs = arg;
    switch_timer_stop();
    (void)take_levels(inputs);
    machine_switch_timer_isr(inputs->machine);
}

static void IRAM_ATTR on_edge(void *arg) {
    struct inputs *inputs = arg;
    const uint32_t status[PIN_BANKS] = {GPIO.status, GPIO.status1.val};
    GPIO.status_w1tc = status[0];
    GPIO.status1_w1tc.val = status[1];
    uint8_t index = inputs->index_gpio;
    if (inputs->encoder != NULL && (status[index / PIN_BANK_WIDTH] >> index % PIN_BANK_WIDTH & 1) != 0)
        encoder_index_isr(inputs->encoder);
    take_sample(inputs);
}

static const struct debounce_time *time_of(unsigned input, const struct input_roles *roles) {
    if (input == INPUT_PROBE || input == INPUT_TOOLSETTER)
        return &probe_time;
    bool stops = input < INPUT_MISC || input - INPUT_MISC == roles->door || input - INPUT_MISC == roles->hold;
    return stops ? &stop_time : &button_time;
}

static gpio_config_t make_config(uint8_t gpio, uint8_t pull) {
    return (gpio_config_t){
        .pin_bit_mask = 1ull << gpio,
        .mode = GPIO_MODE_INPUT,
        .pull_up_en = pull == PIN_PULL_UP ? GPIO_PULLUP_ENABLE : GPIO_PULLUP_DISABLE,
        .pull_down_en = pull == PIN_PULL_DOWN ? GPIO_PULLDOWN_ENABLE : GPIO_PULLDOWN_DISABLE,
        .intr_type = GPIO_INTR_DISABLE,
    };
}

void inputs_init(struct inputs *inputs, const struct input_wire wire[INPUT_COUNT], const struct gang *gang,
                 const struct input_roles *roles) {
    *inputs = (struct inputs){.gang = gang, .roles = *roles};
    for (unsigned input = 0; input < INPUT_COUNT; input++) {
        inputs->wire[input] = wire[input];
        if ((INPUT_SWITCHES >> input & 1) != 0 && wire[input].active_high)
            inputs->switch_high |= 1u << input;
        inputs->debounce.time[input] = *time_of(input, roles);
        if (wire[input].pin == NO_PIN)
            continue;
        const gpio_config_t config = make_config(wire[input].pin, wire[input].pull);
        ESP_ERROR_CHECK(gpio_config(&config));
    }
    inputs_set_levels(inputs, (struct input_senses){0});
}

void inputs_set_levels(struct inputs *inputs, struct input_senses senses) {
    uint32_t active_low = (senses.limit_invert ? 0 : INPUT_SWITCHES) ^ inputs->switch_high;
    active_low |= senses.probe_invert ? 0 : 1u << INPUT_PROBE;
    active_low |= senses.toolsetter_invert ? 0 : 1u << INPUT_TOOLSETTER;
    for (unsigned input = INPUT_ESTOP; input < INPUT_COUNT; input++)
        active_low |= inputs->wire[input].active_high ? 0 : 1u << input;
    active_low ^= senses.estop_normally_open ? 1u << INPUT_ESTOP : 0;
    inputs->active_low = active_low;
    /* From the levels as they are: a changed polarity is not an edge. */
    debounce_start(&inputs->debounce, read_pins(inputs));
}

void inputs_add_index(struct inputs *inputs, struct encoder *encoder, const struct encoder_wire *wire) {
    const gpio_config_t config = make_config(wire->gpio, wire->pull);
    ESP_ERROR_CHECK(gpio_config(&config));
    ESP_ERROR_CHECK(gpio_set_intr_type((gpio_num_t)wire->gpio,
                                       wire->active_high ? GPIO_INTR_POSEDGE : GPIO_INTR_NEGEDGE));
    inputs->encoder = encoder;
    inputs->index_gpio = wire->gpio;
}

bool inputs_attach(struct inputs *inputs, struct machine *machine) {
    const int flags = ESP_INTR_FLAG_IRAM | ESP_INTR_FLAG_LEVEL3; /* as the switch timer's: they never nest */
    if (gpio_isr_register(on_edge, inputs, flags, NULL) != ESP_OK)
        return false;
    inputs->machine = machine;
    if (!switch_timer_init(on_switch_timer, inputs))
        return false;
    for (unsigned input = 0; input < INPUT_COUNT; input++) {
        gpio_num_t gpio = (gpio_num_t)inputs->wire[input].pin;
        if (inputs->wire[input].pin == NO_PIN || (INPUT_STOPPING >> input & 1) == 0)
            continue;
        ESP_ERROR_CHECK(gpio_set_intr_type(gpio, GPIO_INTR_ANYEDGE));
        ESP_ERROR_CHECK(gpio_intr_enable(gpio));
    }
    if (inputs->encoder != NULL)
        ESP_ERROR_CHECK(gpio_intr_enable((gpio_num_t)inputs->index_gpio));
    return true;
}

void inputs_sample(struct inputs *inputs) {
    portENTER_CRITICAL(&lock);
    take_sample(inputs);
    portEXIT_CRITICAL(&lock);
}

static bool IRAM_ATTR misc_is_on(uint32_t on, uint8_t number) {
    return number < DIGITAL_INPUT_COUNT && (on >> (INPUT_MISC + number) & 1) != 0;
}

static struct hal_switches IRAM_ATTR read_switches(const struct inputs *inputs, uint32_t high) {
    return switches_of(inputs->gang, high ^ inputs->switch_high);
}

void IRAM_ATTR inputs_read(const struct inputs *inputs, struct hal_inputs *out) {
    uint32_t on = __atomic_load_n(&inputs->debounce.stable, __ATOMIC_RELAXED);
    uint32_t high = on ^ inputs->active_low;
    out->switches = read_switches(inputs, high);
    out->pins = read_switches(inputs, inputs->debounce.raw ^ inputs->active_low);
    out->probe = (high >> INPUT_PROBE & 1) != 0;
    out->toolsetter = (high >> INPUT_TOOLSETTER & 1) != 0;
    out->lock = inputs->lock;
    out->estop = (on >> INPUT_ESTOP & 1) != 0 || out->lock != HAL_LOCK_NONE;
    out->door = misc_is_on(on, inputs->roles.door);
    out->hold = misc_is_on(on, inputs->roles.hold);
    out->start = misc_is_on(on, inputs->roles.start);
    out->reset = false; /* no board has a button for it */
    out->digital = (uint8_t)(high >> INPUT_MISC);
}
