{% if cookiecutter.what == "pair" %}
"""{{ partial("summary", kinds="robot")[:1].upper() ~ partial("summary", kinds="robot")[1:] }}."""
{% endif %}
