/* A library, and no plug-in. */
int decant_plug_in(void);
int decant_plug_in(void) { return 0; }
