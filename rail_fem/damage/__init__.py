"""What many passes do to a rail: wear by several laws, profiles that change, rolling contact fatigue, traffic and
maintenance. Reading order: wear, rolling, strips, worn_profile, evolution; crossing; fatigue, heat; traffic, study."""
